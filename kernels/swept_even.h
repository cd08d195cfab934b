// Reading of a span where the scene has one pixel per photosite: all its photosites read the same pixels, but for one more, with weights
// that change little along it (swept_area.h). Adjacent pixels of a row then come as vectors.
#ifndef SWEPT_EVEN_H
#define SWEPT_EVEN_H
#include "lanes.h"

#define PIXELS (STEP * (SPAN - 1) + 3) // of a line that a span reads, at most

// Two lines' readings of the photosites of a span: across by `at`, then down.
#define READ_PAIRS(upper, lower)                                                                                   \
    LANES                                                                                                          \
    for (uint i = 0; i < SPAN; i++) {                                                                              \
        const float r = (float)(int)(STEP * i) - reach, at = from + r * (drift + r * path.u_bend);                 \
        const float above = upper[STEP * i] + at * (upper[STEP * i + 1] - upper[STEP * i]);                        \
        const float below = lower[STEP * i] + at * (lower[STEP * i + 1] - lower[STEP * i]);                        \
        value[i] = above + (down + step * (float)(int)i) * (below - above);                                        \
    }

// Copy the pixels of a line from column `first` on, (PIXELS); beyond the scene its edge pixels continue.
INLINE void copy_line(global const float *line, const int first, const uint width, float *pixels) {
    const int begin = clamped(-first, PIXELS + 1), end = clamped((int)width - first, PIXELS + 1);
    const float left = line[0], right = line[width - 1];
    for (int j = 0; j < PIXELS; j++) pixels[j] = j < begin ? left : right;
    for (int j = begin; j < end; j++) pixels[j] = line[first + j];
}

// edge: whether pixels lie beyond the scene.
INLINE void read_even(global const float *plane, const struct path path, const struct projection p, const int edge, float *value) {
    const float drift = path.u_slope - 1.0f, reach = REACH, even = path.u - reach;
    const int first = whole(even + reach * (reach * path.u_bend - (drift < 0.0f ? -drift : drift)));
    const float from = even - (float)first, low = path.v + path.v_slope * (float)first, step = (float)STEP * path.v_slope;
    if (path.rows == 2u && from + reach * (reach * path.u_bend + (drift < 0.0f ? -drift : drift)) < 1.0f) { // 2 x 2 pixels each
        const float down = low + path.v_slope * from;
        global const float *upper = plane + (size_t)clamped(path.row, p.scene_height) * p.scene_width;
        global const float *lower = plane + (size_t)clamped(path.row + 1, p.scene_height) * p.scene_width;
        if (edge) {
            float near[PIXELS], far[PIXELS];
            copy_line(upper, path.column + first, p.scene_width, near);
            copy_line(lower, path.column + first, p.scene_width, far);
            READ_PAIRS(near, far)
            return;
        }
        upper += path.column + first, lower += path.column + first;
        READ_PAIRS(upper, lower)
        return;
    }
    float line[PIXELS];
#if STEP == 1
    float pixels[SPAN + 2];
    for (uint j = 0; j < SPAN + 2; j++) pixels[j] = 0.0f;
    for (uint n = 0; n < path.rows; n++) {
        copy_line(plane + (size_t)clamped(path.row + (int)n, p.scene_height) * p.scene_width, path.column + first, p.scene_width, line);
        for (uint j = 0; j < SPAN + 2; j++)
            pixels[j] += share_of((low - (float)(int)n) + path.v_slope * (float)(int)j, 0.0f) * line[j];
    }
#else
    float left[SPAN + 1], right[SPAN];
    for (uint i = 0; i < SPAN; i++) left[i] = right[i] = 0.0f;
    left[SPAN] = 0.0f;
    for (uint n = 0; n < path.rows; n++) {
        copy_line(plane + (size_t)clamped(path.row + (int)n, p.scene_height) * p.scene_width, path.column + first, p.scene_width, line);
        for (uint i = 0; i < SPAN; i++) {
            const float at = (low - (float)(int)n) + step * (float)(int)i;
            left[i] += share_of(at, 0.0f) * line[2 * i];
            right[i] += share_of(at + path.v_slope, 0.0f) * line[2 * i + 1];
        }
        left[SPAN] += share_of((low - (float)(int)n) + step * SPAN, 0.0f) * line[2 * SPAN];
    }
#endif
    for (uint i = 0; i < SPAN; i++) {
        const float r = (float)(int)(STEP * i) - reach, at = from + r * (drift + r * path.u_bend);
        const float a = at < 1.0f ? 1.0f - at : 0.0f, c = at > 1.0f ? at - 1.0f : 0.0f;
#if STEP == 1
        value[i] = a * pixels[i] + ((1.0f - a) - c) * pixels[i + 1] + c * pixels[i + 2];
#else
        value[i] = a * left[i] + ((1.0f - a) - c) * right[i] + c * left[i + 1];
#endif
    }
}

#endif
