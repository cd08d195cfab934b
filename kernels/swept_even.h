// Reading of a span where the scene has one pixel per photosite: all its photosites read the same pixels, but for one more, with weights
// that change little along it (swept_area.h). Adjacent pixels of a row then come as vectors.
#ifndef SWEPT_EVEN_H
#define SWEPT_EVEN_H
#include "lanes.h"

#define PIXELS (STEP * (SPAN - 1) + 3) // of a line that a span reads, at most

// Where photosite i of a span reads, `at` right of pixel STEP i of what it sees along its row, and `low` below the first row.
#define READ_AT                                                                                                          \
    const float k = (float)(int)(STEP * i), at = from + k * (path.u_drift + (k - 2.0f * REACH) * path.u_bend);           \
    const float down = (low + step * (float)(int)i) + path.v_slope * at;

// Two lines' readings of the photosites of a span: across, then down.
#define READ_PAIRS(upper, lower)                                                                                         \
    LANES                                                                                                                \
    for (uint i = 0; i < SPAN; i++) {                                                                                    \
        READ_AT                                                                                                          \
        const float above = upper[STEP * i] + at * (upper[STEP * i + 1] - upper[STEP * i]);                              \
        const float below = lower[STEP * i] + at * (lower[STEP * i + 1] - lower[STEP * i]);                              \
        value[i] = above + down * (below - above);                                                                       \
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
    const float most = 2.0f * REACH * path.u_drift, swing = REACH * REACH * path.u_bend; // of the last photosite; most is below 1
    const int first = whole(path.u + smaller(most, 0.0f) + smaller(-swing, 0.0f));
    const float from = path.u - (float)first, low = path.v + path.v_slope * (float)first, step = (float)STEP * path.v_slope;
    if (path.rows == 2u && from + larger(most, 0.0f) + larger(-swing, 0.0f) < 1.0f) { // 2 x 2 pixels each
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
    for (uint i = 0; i < SPAN; i++) value[i] = 0.0f;
    for (uint n = 0; n < path.rows; n++) { // of three pixels of a line, and each line with its share for the photosite's own place
        float line[PIXELS];
        copy_line(plane + (size_t)clamped(path.row + (int)n, p.scene_height) * p.scene_width, path.column + first, p.scene_width, line);
        for (uint i = 0; i < SPAN; i++) {
            READ_AT
            const float a = at < 1.0f ? 1.0f - at : 0.0f, c = at > 1.0f ? at - 1.0f : 0.0f;
            const float across = a * line[STEP * i] + ((1.0f - a) - c) * line[STEP * i + 1] + c * line[STEP * i + 2];
            value[i] += share_of(down - (float)(int)n, 0.0f) * across;
        }
    }
}

#endif
