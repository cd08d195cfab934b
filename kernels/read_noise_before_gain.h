// Read noise before the analog gain: electrons [e-] -> electrons + N(0, sigma) [e-].
// With a spread, sigma belongs to the photosite (x, y): log-normal, its mean square as without.
// Random words: see the table in random_numbers.h.
#ifndef READ_NOISE_BEFORE_GAIN_H
#define READ_NOISE_BEFORE_GAIN_H
#include "normal.h"
#include "philox.h"

INLINE float read_noise_before_gain(const float electrons, const float normal, const uint x, const uint y, const uint body_seed,
                                    constant float *parameters) {
    float sigma = READ_NOISE_BEFORE_GAIN_SIGMA_E;
#if READ_NOISE_BEFORE_GAIN_SPREADS
    const struct words counter = {y, x, 0u, READ_NOISE_BEFORE_GAIN_STREAM};
    const struct words body = philox(counter, body_seed, 1u);
    const float z = normal_one(body.a, body.b);
    sigma = sigma * exponential(READ_NOISE_BEFORE_GAIN_SPREAD * (z - READ_NOISE_BEFORE_GAIN_SPREAD));
#endif
    return electrons + sigma * normal;
}

#endif
