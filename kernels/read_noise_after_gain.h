// Read noise after the analog gain: signal [DN] -> signal + N(0, sigma) [DN].
#ifndef READ_NOISE_AFTER_GAIN_H
#define READ_NOISE_AFTER_GAIN_H
#include "conventions.h"

INLINE float read_noise_after_gain(const float signal_dn, const float normal, constant float *parameters) {
    return signal_dn + READ_NOISE_AFTER_GAIN_SIGMA_DN * normal;
}

#endif
