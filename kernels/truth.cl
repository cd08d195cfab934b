// The truth beside a raw frame: what the sensor would give without chance and without the body's fixed pattern.
//
// mean_charge: electron_radiance: (height, width) float32 [e- s^-1 um^-2 sr^-1] in the colour of each photosite, from the lens;
//   mean_electrons: (height, width) float32, mean photoelectrons [e-]; signal: (height, width) float32, mean electrons in the
//   well, dark current included [e-].
// noise_free: signal: in, electrons in the well [e-]; out, mean code without rounding, clipped where the sensor clips [DN].
// parameters, window_x, window_y: as in sensor.cl. One work-item per photosite.
#include "irradiance.h"
#include "exposure.h"
#include "full_well.h"
#include "conversion_gain.h"
#include "analog_gain.h"
#include "nonlinearity.h"

INLINE float clipped(const float code_dn, constant float *parameters) { return larger(0.0f, smaller(code_dn, ADC_WHITE_LEVEL_DN)); }

kernel void mean_charge(global const float *restrict electron_radiance, global float *restrict mean_electrons,
                        global float *restrict signal, constant float *restrict parameters, const uint window_x,
                        const uint window_y) {
    const size_t column = get_global_id(0), row = get_global_id(1), index = row * get_global_size(0) + column;
    const float light = irradiance(electron_radiance[index], (uint)column + window_x, (uint)row + window_y, parameters);
    float electrons = exposure(light, parameters);
    mean_electrons[index] = electrons;
    if (DARK_CURRENT) electrons = electrons + DARK_CURRENT_MEAN_E;
    if (FULL_WELL) electrons = full_well(electrons, parameters);
    signal[index] = electrons;
}

kernel void noise_free(global float *restrict signal, constant float *restrict parameters) {
    const size_t index = get_global_id(1) * get_global_size(0) + get_global_id(0);
    float level = signal[index];
    if (CONVERSION_GAIN) level = conversion_gain(level, parameters);
    if (ANALOG_GAIN) level = analog_gain(level, parameters);
    if (NONLINEARITY) level = nonlinearity(level, parameters);
    level = clipped(level + ADC_BLACK_LEVEL_DN, parameters);
    if (DIGITAL_GAIN) {
        const float scaled = DIGITAL_GAIN_FACTOR * (level - DIGITAL_GAIN_BLACK_LEVEL_DN);
        level = clipped(DIGITAL_GAIN_BLACK_LEVEL_DN + scaled, parameters);
    }
    signal[index] = level;
}
