// Column offset: signal [DN] -> signal + N(0, sigma) of the column [DN], a pattern that belongs to the body; x: column.
#ifndef COLUMN_OFFSET_H
#define COLUMN_OFFSET_H
#include "normal.h"
#include "philox.h"

INLINE float column_offset(const float signal_dn, const uint x, const uint body_seed, constant float *parameters) {
    const struct words counter = {0u, x, 0u, COLUMN_OFFSET_STREAM};
    const struct words body = philox(counter, body_seed, 1u);
    return signal_dn + COLUMN_OFFSET_SIGMA_DN * normal_one(body.a, body.b);
}

#endif
