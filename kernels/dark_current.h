// Dark current: electrons [e-] -> electrons + Poisson(mean) [e-]; x, y: photosite on the sensor.
#ifndef DARK_CURRENT_H
#define DARK_CURRENT_H
#include "philox.h"
#include "poisson.h"

INLINE float dark_current(const float electrons, const uint x, const uint y, const uint frame_seed, constant float *parameters) {
    const struct words counter = {y, x, 0u, DARK_CURRENT_STREAM};
    const struct words random = philox(counter, frame_seed, 0u);
    const uint zero = zero_after(electrons);
    return electrons + poisson(DARK_CURRENT_MEAN_E, normal_one(random.a ^ zero, random.b), random.c ^ zero, DARK_CURRENT_MEANS);
}

#endif
