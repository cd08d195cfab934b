// ADC: signal [DN] -> code as a float, nearest integer, ties to even, from 0 to the code at which the ADC or its input clips.
#ifndef ADC_H
#define ADC_H
#include "plain_math.h"

INLINE float adc(const float signal_dn, constant float *parameters) {
    return nearest(larger(0.0f, smaller(signal_dn + ADC_BLACK_LEVEL_DN, ADC_WHITE_LEVEL_DN)));
}

#endif
