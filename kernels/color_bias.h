// Colour bias: signal [DN] -> signal + per-channel black offset of the 2x2 block [DN]; x, y: photosite on the sensor.
#ifndef COLOR_BIAS_H
#define COLOR_BIAS_H
#include "conventions.h"

INLINE float color_bias(const float signal_dn, const uint x, const uint y, constant float *parameters) {
    const float even = (x & 1u) ? COLOR_BIAS_OFFSETS_DN[1] : COLOR_BIAS_OFFSETS_DN[0];
    const float odd = (x & 1u) ? COLOR_BIAS_OFFSETS_DN[3] : COLOR_BIAS_OFFSETS_DN[2];
    return signal_dn + ((y & 1u) ? odd : even);
}

#endif
