// Dead pixels: electrons [e-] -> 0 in the share of photosites that do not respond to light. word: of the body (random_numbers.h).
#ifndef DEAD_PIXELS_H
#define DEAD_PIXELS_H
#include "uniform.h"

INLINE float dead_pixels(const float electrons, const uint word, constant float *parameters) {
    return uniform(word) < DEAD_PIXELS_SHARE ? 0.0f : electrons;
}

#endif
