// Dark current: electrons [e-] -> electrons + Poisson(rate * time) [e-]; x, y: photosite on the sensor.
#ifndef DARK_CURRENT_H
#define DARK_CURRENT_H
#include "conventions.h"
#include "philox.h"
#include "poisson.h"

INLINE float dark_current(const float electrons, const uint x, const uint y, const uint frame_seed,
                                 constant float *parameters) {
    const struct words counter = {y, x, 0u, DARK_CURRENT_STREAM};
    const struct words random = philox(counter, frame_seed, 0u);
    return electrons + poisson(DARK_CURRENT_RATE_E_PER_S * DARK_CURRENT_TIME_S, random.a, random.b);
}

#endif
