// Readings of a span of photosites of a layer that drifts along the row (layer_spans.h, DRIFTS 1): of two or three rows, each photosite at its
// own place.
#ifndef LAYER_DRIFT_H
#define LAYER_DRIFT_H
#include "layer_lines.h"

// Mean of values in a column around what is `below` the first. two: of the first two; else of three.
INLINE float mean_of(const float first, const float second, const float third, const float below, const int two) {
    if (two) return between(first, second, below);
    const float upper = larger(1.0f - below, 0.0f), lower = larger(below - 1.0f, 0.0f);
    return upper * first + ((1.0f - upper) - lower) * second + lower * third;
}

// Mix rows into PIXELS pixels from column `first` on, of which a photosite begins with each. Beyond the plane its edge pixels continue.
INLINE void mix_rows(global const float *const *rows, const int first, const float below, const float tilt, const uint width, const int two,
                     float *line) {
    const int begin = clamped(-first, PIXELS + 1), end = clamped((int)width - first, PIXELS + 1), last = (int)width - 1;
    const float left[3] = {rows[0][0], rows[1][0], rows[2][0]}, right[3] = {rows[0][last], rows[1][last], rows[2][last]};
    for (int j = 0; j < begin; j++) line[j] = mean_of(left[0], left[1], left[2], below + tilt * (float)j, two);
    for (int j = begin; j < end; j++)
        line[j] = mean_of(rows[0][first + j], rows[1][first + j], rows[2][first + j], below + tilt * (float)j, two);
    for (int j = end; j < PIXELS; j++) line[j] = mean_of(right[0], right[1], right[2], below + tilt * (float)j, two);
}

INLINE void mix_drift(const struct lines at, const int first, const struct spot spot, const uint width, float *line) {
    const float begin = spot.below - spot.tilt * MIDDLE, end = begin + spot.tilt * (float)(PIXELS - 1);
    if (larger(begin, end) <= 1.0f) mix_rows(at.left, first, begin, spot.tilt, width, 1, line);
    else mix_rows(at.left, first, begin, spot.tilt, width, 0, line);
}

// Reading of photosite i of a span: of its pixels, or, where some of a span lie beyond the plane or three beside each other are read, of
// lines that are mixed already.
INLINE float read_drift(const struct lines at, const float *line, const int mixed_before, const uint i, const struct spot spot) {
    const float r = (float)(int)(STEP * i) - MIDDLE, past = spot.past + r * (spot.slope + r * spot.bend);
    if (mixed_before) {
        const float left = larger(1.0f - past, 0.0f), right = larger(past - 1.0f, 0.0f);
        return left * line[STEP * i] + ((1.0f - left) - right) * line[STEP * i + 1] + right * line[STEP * i + 2];
    }
    const float below = spot.below + spot.tilt * r, next = below + spot.tilt;
    return between(between(at.left[0][STEP * i], at.left[1][STEP * i], below),
                   between(at.left[0][STEP * i + 1], at.left[1][STEP * i + 1], next), past);
}

#endif
