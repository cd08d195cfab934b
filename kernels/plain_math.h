// Elementary functions from arithmetic operators only. The built-in ones are scalar calls on some PoCL builds and differ between
// devices; these vectorise everywhere and, with contraction off, give the same bits on every IEEE device.
// Polynomials: near-minimax fits made for this file (Lawson-weighted least squares in float64).
#ifndef PLAIN_MATH_H
#define PLAIN_MATH_H
#include "conventions.h"

INLINE float smaller(const float a, const float b) { return a < b ? a : b; }
INLINE float larger(const float a, const float b) { return a > b ? a : b; }
INLINE float size_of(const float v) { return v < 0.0f ? -v : v; }

// Nearest of the numbers from 0 to count - 1.
INLINE int clamped(const int i, const uint count) { return i < 0 ? 0 : (i < (int)count ? i : (int)count - 1); }

// Greatest integer not above v.
INLINE int whole(const float v) { return (int)v - (v < (float)(int)v ? 1 : 0); }

// 1/x for normal x > 0: integer seed (12 % off), three Newton steps; relative error below 2e-7.
INLINE float reciprocal(const float x) {
    float y = as_float(0x7EF311C7u - as_uint(x));
    y = y * (2.0f - x * y);
    y = y * (2.0f - x * y);
    return y * (2.0f - x * y);
}

// 1/sqrt(x) for normal x > 0: integer seed and first step with Kadlec's constants (0.065 % off), one Newton step;
// relative error below 8e-7. Finite at 0.
INLINE float reciprocal_square_root(const float x) {
    float y = as_float(0x5F1FFFF9u - (as_uint(x) >> 1));
    y = y * (1.68191391f - 0.703952253f * x * y * y);
    return y * (1.5f - 0.5f * x * y * y);
}

// ln x for normal x > 0: exponent plus polynomial on [sqrt(1/2), sqrt(2)); relative error below 1e-5 on (0, 1], far below
// what is visible in the distribution of random numbers.
INLINE float natural_log(const float x) {
    const uint shifted = as_uint(x) - 0x3F3504F3u;
    const int exponent = (int)shifted >> 23;
    const float f = as_float((shifted & 0x007FFFFFu) + 0x3F3504F3u) - 1.0f;
    float p = -1.4216049e-01f;
    p = p * f + 2.1928113e-01f;
    p = p * f - 2.5387970e-01f;
    p = p * f + 3.3274031e-01f;
    p = p * f - 4.9991740e-01f;
    p = p * f + 1.0f;
    return f * p + (float)exponent * 6.931471806e-01f;
}

// Nearest integer, ties to even, for |x| < 2^22 (adding 1.5 * 2^23 leaves no fraction bits).
INLINE float nearest(const float x) { return (x + 12582912.0f) - 12582912.0f; }

// e^x for -80 <= x <= 80: power of two times polynomial on [-1/2, 1/2]; relative error below 5e-7 * max(1, |x|).
INLINE float exponential(const float x) {
    const float scaled = x * 1.442695041f;
    const float whole = nearest(scaled);
    const float t = scaled - whole;
    float p = 1.327647174e-03f;
    p = p * t + 9.675541540e-03f;
    p = p * t + 5.550713276e-02f;
    p = p * t + 2.402211972e-01f;
    p = p * t + 6.931469671e-01f;
    p = p * t + 1.0f;
    return p * as_float((uint)(127 + (int)whole) << 23);
}

// 1 - e^-x for 0 <= x <= 80: a series where the difference would lose digits; relative error below 1e-6.
INLINE float lost_share(const float x) {
    float p = 1.0f - x * (1.0f / 8.0f);
    p = 1.0f - x * (1.0f / 7.0f) * p;
    p = 1.0f - x * (1.0f / 6.0f) * p;
    p = 1.0f - x * (1.0f / 5.0f) * p;
    p = 1.0f - x * 0.25f * p;
    p = 1.0f - x * (1.0f / 3.0f) * p;
    p = 1.0f - x * 0.5f * p;
    return x < 0.5f ? x * p : 1.0f - exponential(-x);
}

#endif
