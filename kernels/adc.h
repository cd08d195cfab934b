// ADC: signal [DN] -> code 0 ... 2^n - 1 as a float, nearest integer, ties to even.
#ifndef ADC_H
#define ADC_H
#include "plain_math.h"

INLINE float adc(const float signal_dn, constant float *parameters) {
    return nearest(larger(0.0f, smaller(signal_dn + ADC_BLACK_LEVEL_DN, ADC_MAX_CODE_DN)));
}

#endif
