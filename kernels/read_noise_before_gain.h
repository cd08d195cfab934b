// Read noise before the analog gain: electrons [e-] -> electrons + N(0, sigma) [e-].
#ifndef READ_NOISE_BEFORE_GAIN_H
#define READ_NOISE_BEFORE_GAIN_H
#include "conventions.h"

INLINE float read_noise_before_gain(const float electrons, const float normal, constant float *parameters) {
    return electrons + READ_NOISE_BEFORE_GAIN_SIGMA_E * normal;
}

#endif
