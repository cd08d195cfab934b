// Digital gain: code [DN] -> black level + factor * (code - black level), rounded and clipped once more.
#ifndef DIGITAL_GAIN_H
#define DIGITAL_GAIN_H
#include "plain_math.h"

INLINE float digital_gain(const float code_dn, constant float *parameters) {
    const float scaled_dn = DIGITAL_GAIN_BLACK_LEVEL_DN + DIGITAL_GAIN_FACTOR * (code_dn - DIGITAL_GAIN_BLACK_LEVEL_DN);
    return nearest(larger(0.0f, smaller(scaled_dn, ADC_WHITE_LEVEL_DN)));
}

#endif
