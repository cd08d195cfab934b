// The truth beside a raw frame: what the sensor would give without chance.
//
// electron_radiance: (height, width) float32 [e- s^-1 um^-2 sr^-1] in the colour of each photosite, from the lens.
// mean_electrons:    (height, width) float32, mean photoelectrons [e-].
// noise_free:        (height, width) float32, mean code without rounding, clipped where the sensor clips [DN].
// parameters, window_x, window_y: as in sensor.cl. One work-item per photosite.
#include "irradiance.h"
#include "exposure.h"
#include "full_well.h"
#include "analog_gain.h"

kernel void truth(global const float *restrict electron_radiance, global float *restrict mean_electrons,
                  global float *restrict noise_free, constant float *restrict parameters, const uint window_x,
                  const uint window_y) {
    const size_t column = get_global_id(0), row = get_global_id(1), index = row * get_global_size(0) + column;
    float signal = irradiance(electron_radiance[index], (uint)column + window_x, (uint)row + window_y, parameters);
    signal = exposure(signal, parameters);
    mean_electrons[index] = signal;
#if DARK_CURRENT
    signal = signal + DARK_CURRENT_RATE_E_PER_S * DARK_CURRENT_TIME_S;
#endif
#if FULL_WELL
    signal = full_well(signal, parameters);
#endif
#if ANALOG_GAIN
    signal = analog_gain(signal, parameters);
#endif
    noise_free[index] = larger(0.0f, smaller(signal + ADC_BLACK_LEVEL_DN, ADC_MAX_CODE_DN));
}
