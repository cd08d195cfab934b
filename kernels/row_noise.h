// Row noise: signal [DN] -> signal + N(0, sigma) of the row [DN], new in each frame; y: row.
#ifndef ROW_NOISE_H
#define ROW_NOISE_H
#include "normal.h"
#include "philox.h"

INLINE float row_noise(const float signal_dn, const uint y, const uint frame_seed, constant float *parameters) {
    const struct words counter = {y, 0u, 0u, ROW_NOISE_STREAM};
    const struct words random = philox(counter, frame_seed, 0u);
    return signal_dn + ROW_NOISE_SIGMA_DN * normal_one(random.a, random.b);
}

#endif
