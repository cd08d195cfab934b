// Numbers from one random word: uniform between 0 and 1, and exponentially distributed with mean 1.
#ifndef UNIFORM_H
#define UNIFORM_H
#include "plain_math.h"

// (k + 1/2) / 2^24: never 0, never above 1 - 2^-25, which float32 rounds to 1.
INLINE float uniform(const uint word) { return (float)(word >> 8) * 5.9604644775390625e-08f + 2.98023223876953125e-08f; }

// (k + 1/2) / 2^31, rounded to float32: from 2.3e-10, where it is as fine, to 1.
INLINE float fine_uniform(const uint word) { return ((float)(int)(word >> 1) + 0.5f) * 4.656612873077393e-10f; }

// -ln u, u from 31 bits: up to 22.
INLINE float exponential_variate(const uint word) { return -natural_log(fine_uniform(word)); }

#endif
