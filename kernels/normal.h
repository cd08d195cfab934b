// Standard normal numbers from random words by Box and Muller (1958): sqrt(-2 ln u) times the cosine and the sine of 2 pi v.
#ifndef NORMAL_H
#define NORMAL_H
#include "uniform.h"

// sin(2 pi t) for t in [-1/4, 1/4] turns, error below 1e-7 (fit as in plain_math.h).
INLINE float sine_of_turn(const float t) {
    const float s = t * t;
    return t * (6.283185162f + s * (-41.34165537f + s * (81.60102086f + s * (-76.55010747f + s * 39.53886656f))));
}

// sqrt(-2 ln u), u in (0, 1] from 31 bits, so that the tail reaches 6.7 sigma. 0 at 1, where the reciprocal stays finite.
INLINE float normal_radius(const uint word) {
    const float square = 2.0f * exponential_variate(word);
    return square * reciprocal_square_root(square);
}

// Return one N(0, 1) from two words. v in [-1/2, 1/2) turns; cos 2 pi v = sin 2 pi (1/4 - |v|).
INLINE float normal_one(const uint word0, const uint word1) {
    const float v = (float)(int)word1 * 2.3283064365386963e-10f;
    return normal_radius(word0) * sine_of_turn(0.25f - (v < 0.0f ? -v : v));
}

// Draw two independent N(0, 1) from two words. The angle lies in the half turn t * pi/2, t in [-1, 1), where the cosine is positive; the
// word's highest bit is its sign. Errors below 8e-6 and 2e-6.
// Cosine and sine are polynomials of different form on purpose: some compilers combine two similar ones into one vector, and then
// cannot vectorise across photosites. For the same reason the numbers are not returned as a struct of two floats.
INLINE void normal_two(const uint word0, const uint word1, float *first, float *second) {
    const float radius = normal_radius(word0);
    const float t = (float)(int)(word1 << 1) * 4.656612873077393e-10f;
    const float s = t * t;
    const float cosine = 1.0f + s * (-1.23354172f + s * (2.5269785e-01f + s * -1.916397e-02f));
    const float sine = t * (1.57079514f + s * (-6.4592596e-01f + s * (7.950065e-02f + s * -4.37101e-03f)));
    *first = as_float(as_uint(radius * cosine) ^ (word1 & 0x80000000u));
    *second = radius * sine;
}

#endif
