// Random telegraph noise: electrons [e-] -> electrons - A, + 0 or + A [e-] with probabilities 1/4, 1/2, 1/4 in a share of the
// photosites: the state of one trap at the two samples whose difference is read. A is exponentially distributed over the body.
// Random words: see the table in random_numbers.h.
#ifndef RANDOM_TELEGRAPH_NOISE_H
#define RANDOM_TELEGRAPH_NOISE_H
#include "philox.h"
#include "uniform.h"

INLINE float random_telegraph_noise(const float electrons, const uint x, const uint y, const uint frame_seed, const uint body_seed,
                                    constant float *parameters) {
    const struct words counter = {y, x, 0u, RANDOM_TELEGRAPH_NOISE_STREAM};
    const struct words body = philox(counter, body_seed, 1u), random = philox(counter, frame_seed, 0u);
    const float amplitude_e = RANDOM_TELEGRAPH_NOISE_AMPLITUDE_E * exponential_variate(body.b);
    const int jump = (int)(random.a & 1u) - (int)((random.a >> 1) & 1u);
    return electrons + (uniform(body.a) < RANDOM_TELEGRAPH_NOISE_SHARE ? amplitude_e * (float)jump : 0.0f);
}

#endif
