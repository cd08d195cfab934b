// Where a span of photosites of a row sees a fine scene through a small blur circle (scene_gather.cl).
#ifndef GATHERED_SPAN_H
#define GATHERED_SPAN_H
#include "cfa.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "photosite_area.h"

struct gather {
    int origin_x, origin_y;   // photosite of the sensor at [0, 0] of the frame
    uint width, height;       // of the frame
    uint light_row;           // row of `light` at the frame's first row
    uint map;                 // of `radius`
    int map_column, map_row;  // photosite of the map at [0, 0] of the frame
    uint map_rows, set_columns; // rows of each map, and columns of each of its column sets
};

struct gathered_span {
    int first_x[SPAN], first_y[SPAN];   // pixels from which on light may come
    float left[SPAN], top[SPAN];        // middle of the photosite [px right of and below where they begin]
    float wide[SPAN], tall[SPAN];       // of the photosite [px]
    float across[SPAN], down[SPAN];     // signed radius of the aperture's image [px]
    float slope_x[SPAN], slope_y[SPAN]; // LEANS 1: how far to the right what lies farther down is moved, and down what lies farther right
};

// Blur radius of a photosite, and its change by one to the right and down, from those of the photosites around it.
INLINE void graded_radius(global const float *radius, const struct gather frame, const int column, const int row, float *blur, float *right,
                          float *below) {
    const int x = frame.map_column + column, y = frame.map_row + row;
    global const float *own = radius + row_start(2 * frame.map, (size_t)y, frame.map_rows, frame.set_columns);
    const size_t plane = (size_t)frame.map_rows * frame.set_columns;
    *blur = own[(x & 1) * plane + (x >> 1)];
    *right = 0.5f * (own[((x + 1) & 1) * plane + ((x + 1) >> 1)] - own[((x - 1) & 1) * plane + ((x - 1) >> 1)]);
    *below = 0.5f * (own[(x & 1) * plane + (x >> 1) + frame.set_columns] - own[(x & 1) * plane + (x >> 1) - frame.set_columns]);
}

// A span from a photosite of the frame on. blur: its radius, GRADED 0. Photosites beside the frame repeat those at its border.
INLINE void span_of(global const float *radius, const struct gather frame, const int column, const int row, const float blur,
                    const struct projection p, struct gathered_span *span) {
    const float size = 1.0f - 2.0f * INSET;
    LANES
    for (uint n = 0; n < SPAN; n++) {
        const int own = clamped(column + (int)n, frame.width), x = frame.origin_x + own, y = frame.origin_y + row;
        float image = blur, tilt_x = 0.0f, tilt_y = 0.0f, aside, below;
#if GRADED
        graded_radius(radius, frame, own, row, &image, &tilt_x, &tilt_y);
#endif
        const struct displacement lens = moved_by_lens((float)x + 0.5f, (float)y + 0.5f, cfa_plane((uint)own, (uint)row));
        const struct area turned = area_of(x, y, INSET, size, lens, p), area = upright(turned);
        step_over(turned, size, image, tilt_x, tilt_y, &aside, &below);
        const float side_x = extent(area.wide, area.tilt_right), side_y = extent(area.tall, area.tilt_down);
        const float wide = LEANS ? area.wide : side_x, tall = LEANS ? area.tall : side_y;
        const float slope_x = LEANS ? area.tilt_right / area.tall : 0.0f, slope_y = LEANS ? area.tilt_down / area.wide : 0.0f;
        const float reach_x = 0.5f * wide + REACH / size * side_x * size_of(image);
        const float reach_y = 0.5f * tall + REACH / size * side_y * size_of(image);
        const float middle_x = area.left + 0.25f * aside + 0.5f * area.wide, middle_y = area.top + 0.25f * below + 0.5f * area.tall;
        const int past_x = whole(middle_x - reach_x - size_of(slope_x) * reach_y);
        const int past_y = whole(middle_y - reach_y - size_of(slope_y) * reach_x);
        span->first_x[n] = area.column + past_x, span->first_y[n] = area.row + past_y;
        span->left[n] = middle_x - (float)past_x, span->top[n] = middle_y - (float)past_y;
        span->wide[n] = wide, span->tall[n] = tall, span->slope_x[n] = slope_x, span->slope_y[n] = slope_y;
        span->across[n] = side_x / size * image, span->down[n] = side_y / size * image;
    }
}

#endif
