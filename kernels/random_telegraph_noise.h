// Random telegraph noise: electrons [e-] -> electrons - A, + 0 or + A [e-] with probabilities 1/4, 1/2, 1/4 in a share of the
// photosites: the state of one trap at the two samples whose difference is read. A is exponentially distributed over the body.
// bits: see random_numbers.h.
#ifndef RANDOM_TELEGRAPH_NOISE_H
#define RANDOM_TELEGRAPH_NOISE_H
#include "random_numbers.h"
#include "uniform.h"

INLINE float random_telegraph_noise(const float electrons, const uint *bits, constant float *parameters) {
    const uint later = zero_after(electrons) << 16; // << 16: fine_uniform drops the lowest bit; see zero_after
    const float amplitude_e = RANDOM_TELEGRAPH_NOISE_AMPLITUDE_E * exponential_variate(bits[TRAP_SIZE] ^ later);
    const int jump = (int)(bits[TRAP_JUMP] & 1u) - (int)((bits[TRAP_JUMP] >> 1) & 1u);
    return electrons + (uniform(bits[TRAP]) < RANDOM_TELEGRAPH_NOISE_SHARE ? amplitude_e * (float)jump : 0.0f);
}

#endif
