// Ground truth of a raw frame: the sensor's signal without noise and without the body's fixed pattern.
//
// mean_charge: light: (frames, height, width) float32, electron radiance [e- s^-1 um^-2 sr^-1] in the colour of each photosite,
//   from the lens, or mean photoelectrons [e-] without IRRADIANCE and EXPOSURE; mean_electrons: likewise, mean photoelectrons
//   [e-]; signal: likewise, mean electrons in the well, dark current included [e-].
// noise_free: signal: in, electrons in the well [e-]; out, mean code without rounding, clipped where the sensor clips [DN].
// frames: (frames of this launch, 3) uint32: index in the stack; x and y of the upper left photosite on the sensor [px].
// numbers: (frames of this launch, NUMBERS) float32, as in sensor.cl.
// One work-item per photosite: dimension 0 runs over columns, 1 over rows, 2 over the frames of this launch.
#include "irradiance.h"
#include "exposure.h"
#include "full_well.h"
#include "conversion_gain.h"
#include "analog_gain.h"
#include "nonlinearity.h"

INLINE float clip_code(const float code_dn, constant float *parameters) { return larger(0.0f, smaller(code_dn, ADC_WHITE_LEVEL_DN)); }

// Index in the stack of this work-item's photosite.
INLINE size_t index_in_stack(global const uint *frames) {
    const size_t row = frames[3 * get_global_id(2)] * get_global_size(1) + get_global_id(1);
    return row * get_global_size(0) + get_global_id(0);
}

kernel void mean_charge(global const float *restrict light, global float *restrict mean_electrons, global float *restrict signal,
                        global const uint *restrict frames, constant float *restrict numbers) {
    const size_t frame = get_global_id(2), index = index_in_stack(frames);
    constant float *parameters = numbers + frame * NUMBERS;
    const uint x = frames[3 * frame + 1] + (uint)get_global_id(0), y = frames[3 * frame + 2] + (uint)get_global_id(1);
    float electrons = light[index];
    if (IRRADIANCE) electrons = irradiance(electrons, x, y, parameters);
    if (EXPOSURE) electrons = exposure(electrons, parameters);
    mean_electrons[index] = electrons;
    if (DARK_CURRENT) electrons = electrons + DARK_CURRENT_MEAN_E;
    if (FULL_WELL) electrons = full_well(electrons, parameters);
    signal[index] = electrons;
}

kernel void noise_free(global float *restrict signal, global const uint *restrict frames, constant float *restrict numbers) {
    const size_t index = index_in_stack(frames);
    constant float *parameters = numbers + get_global_id(2) * NUMBERS;
    float level = signal[index];
    if (CONVERSION_GAIN) level = conversion_gain(level, parameters);
    if (ANALOG_GAIN) level = analog_gain(level, parameters);
    if (NONLINEARITY) level = nonlinearity(level, parameters);
    if (ADC) level = clip_code(level + ADC_BLACK_LEVEL_DN, parameters);
    if (DIGITAL_GAIN) {
        const float scaled = DIGITAL_GAIN_FACTOR * (level - DIGITAL_GAIN_BLACK_LEVEL_DN);
        level = clip_code(DIGITAL_GAIN_BLACK_LEVEL_DN + scaled, parameters);
    }
    signal[index] = level;
}
