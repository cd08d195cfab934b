// Colour bias: signal [DN] -> signal + per-channel black offset of the 2x2 block [DN]; x, y: photosite on the sensor.
#ifndef COLOR_BIAS_H
#define COLOR_BIAS_H
#include "conventions.h"

// Bits of the first number where `mask` has ones, else of the second. `?:` on two entries of an array becomes a choice of address,
// which no compiler turns into vectors.
INLINE uint either(const uint mask, const float first, const float second) {
    return (as_uint(first) & mask) | (as_uint(second) & ~mask);
}

INLINE float color_bias(const float signal_dn, const uint x, const uint y, constant float *parameters) {
    const uint odd_column = 0u - (x & 1u), odd_row = 0u - (y & 1u); // all bits or none
    const uint above = either(odd_column, COLOR_BIAS_OFFSETS_DN[1], COLOR_BIAS_OFFSETS_DN[0]);
    const uint below = either(odd_column, COLOR_BIAS_OFFSETS_DN[3], COLOR_BIAS_OFFSETS_DN[2]);
    return signal_dn + as_float((below & odd_row) | (above & ~odd_row));
}

#endif
