// Ground truth of a raw frame: the sensor's signal without noise and without the body's fixed pattern.
//
// mean_electrons: light: (frames, height, width) float32, electron radiance [e- s^-1 um^-2 sr^-1] in the colour of each photosite,
//   from the lens, or mean photoelectrons [e-] without IRRADIANCE and EXPOSURE; electrons: likewise, mean photoelectrons [e-].
// mean_charge: light: as above; charge: likewise, mean electrons in the well, dark current included [e-].
// code_of_charge: signal: in, electrons in the well [e-]; out, mean code without rounding, clipped where the sensor clips [DN].
// code_of_light: light: as above; code: likewise, both in one: the mean code of a sensor whose photosites share no charge [DN].
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

INLINE float photoelectrons(float electrons, const uint x, const uint y, constant float *parameters) {
    if (IRRADIANCE) electrons = irradiance(electrons, x, y, parameters);
    if (EXPOSURE) electrons = exposure(electrons, parameters);
    return electrons;
}

INLINE float collected(float electrons, constant float *parameters) {
    if (DARK_CURRENT) electrons = electrons + DARK_CURRENT_MEAN_E;
    if (FULL_WELL) electrons = full_well(electrons, parameters);
    return electrons;
}

INLINE float coded(float level, constant float *parameters) {
    if (CONVERSION_GAIN) level = conversion_gain(level, parameters);
    if (ANALOG_GAIN) level = analog_gain(level, parameters);
    if (NONLINEARITY) level = nonlinearity(level, parameters);
    if (ADC) level = clip_code(level + ADC_BLACK_LEVEL_DN, parameters);
    if (DIGITAL_GAIN) {
        const float scaled = DIGITAL_GAIN_FACTOR * (level - DIGITAL_GAIN_BLACK_LEVEL_DN);
        level = clip_code(DIGITAL_GAIN_BLACK_LEVEL_DN + scaled, parameters);
    }
    return level;
}

// Index in the stack of this work-item's photosite.
INLINE size_t index_in_stack(global const uint *frames) {
    const size_t row = frames[3 * get_global_id(2)] * get_global_size(1) + get_global_id(1);
    return row * get_global_size(0) + get_global_id(0);
}

// Photoelectrons of this work-item's photosite.
INLINE float electrons_here(const float light, global const uint *frames, constant float *parameters) {
    const uint x = frames[3 * get_global_id(2) + 1] + (uint)get_global_id(0);
    return photoelectrons(light, x, frames[3 * get_global_id(2) + 2] + (uint)get_global_id(1), parameters);
}

kernel void mean_electrons(global const float *restrict light, global float *restrict electrons, global const uint *restrict frames,
                           constant float *restrict numbers) {
    const size_t index = index_in_stack(frames);
    electrons[index] = electrons_here(light[index], frames, numbers + get_global_id(2) * NUMBERS);
}

kernel void mean_charge(global const float *restrict light, global float *restrict charge, global const uint *restrict frames,
                        constant float *restrict numbers) {
    const size_t index = index_in_stack(frames);
    constant float *parameters = numbers + get_global_id(2) * NUMBERS;
    charge[index] = collected(electrons_here(light[index], frames, parameters), parameters);
}

kernel void code_of_charge(global float *restrict signal, global const uint *restrict frames, constant float *restrict numbers) {
    const size_t index = index_in_stack(frames);
    signal[index] = coded(signal[index], numbers + get_global_id(2) * NUMBERS);
}

kernel void code_of_light(global const float *restrict light, global float *restrict code, global const uint *restrict frames,
                          constant float *restrict numbers) {
    const size_t index = index_in_stack(frames);
    constant float *parameters = numbers + get_global_id(2) * NUMBERS;
    code[index] = coded(collected(electrons_here(light[index], frames, parameters), parameters), parameters);
}
