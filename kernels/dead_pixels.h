// Dead pixels: electrons [e-] -> 0 in the share of photosites that do not respond to light; x, y: photosite on the sensor.
// Random words: see the table in random_numbers.h.
#ifndef DEAD_PIXELS_H
#define DEAD_PIXELS_H
#include "philox.h"
#include "uniform.h"

INLINE float dead_pixels(const float electrons, const uint x, const uint y, const uint body_seed, constant float *parameters) {
    const struct words counter = {y, x, 0u, DEAD_PIXELS_STREAM};
    return uniform(philox(counter, body_seed, 1u).a) < DEAD_PIXELS_SHARE ? 0.0f : electrons;
}

#endif
