// Read noise after the analog gain: signal [DN] -> signal + noise of deviation sigma [DN], normal or Tukey-lambda distributed.
// Tukey-lambda: its quantile function of a normal number's probability, as a polynomial SHAPE in the square (host's fit).
#ifndef READ_NOISE_AFTER_GAIN_H
#define READ_NOISE_AFTER_GAIN_H
#include "conventions.h"

INLINE float read_noise_after_gain(const float signal_dn, const float normal, constant float *parameters) {
#if READ_NOISE_AFTER_GAIN_SHAPE_COUNT
    const float square = normal * normal;
    float factor = READ_NOISE_AFTER_GAIN_SHAPE[READ_NOISE_AFTER_GAIN_SHAPE_COUNT - 1];
    __attribute__((opencl_unroll_hint(READ_NOISE_AFTER_GAIN_SHAPE_COUNT)))
    for (int order = READ_NOISE_AFTER_GAIN_SHAPE_COUNT - 2; order >= 0; order--)
        factor = factor * square + READ_NOISE_AFTER_GAIN_SHAPE[order];
#else
    const float factor = 1.0f;
#endif
    return signal_dn + READ_NOISE_AFTER_GAIN_SIGMA_DN * (normal * factor);
}

#endif
