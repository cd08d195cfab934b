// Exact means of even squares over upright rectangles: the areas that photosites see, or those of a pose with the variance of their
// parallelogram along both axes.
#ifndef UPRIGHT_AREA_H
#define UPRIGHT_AREA_H
#include "lanes.h"
#include "photosite_area.h"

// Means of a plane over `count` areas, up to BATCH, each of which touches at most TAPS pixels on either axis.
INLINE void upright_means(global const float *plane, const struct areas *seen, const uint count, const struct projection p, float *mean) {
    int column[BATCH], row[BATCH];
    float low_x[BATCH], low_y[BATCH], high_x[BATCH], high_y[BATCH], across[BATCH];
    LANES
    for (uint n = 0; n < count; n++) {
        const struct area own = {seen->column[n], seen->row[n],  seen->left[n],       seen->top[n],
                                 seen->wide[n],   seen->tall[n], seen->tilt_right[n], seen->tilt_down[n]};
        const struct area area = upright(own);
        const float wide = extent(area.wide, area.tilt_right), tall = extent(area.tall, area.tilt_down);
        const float left = area.left + 0.5f * (area.wide - wide), top = area.top + 0.5f * (area.tall - tall);
        const int past_x = whole(left), past_y = whole(top);
        column[n] = area.column + past_x, row[n] = area.row + past_y;
        low_x[n] = left - (float)past_x, low_y[n] = top - (float)past_y, high_x[n] = low_x[n] + wide, high_y[n] = low_y[n] + tall;
        mean[n] = 0.0f;
    }
    for (uint j = 0; j < TAPS; j++) {
        for (uint n = 0; n < count; n++) across[n] = 0.0f;
        for (uint i = 0; i < TAPS; i++) {
            LANES
            for (uint n = 0; n < count; n++) {
                const size_t line = (size_t)clamped(row[n] + (int)j, p.scene_height) * p.scene_width;
                across[n] += overlap(low_x[n], high_x[n], i) * plane[line + (size_t)clamped(column[n] + (int)i, p.scene_width)];
            }
        }
        for (uint n = 0; n < count; n++) mean[n] += overlap(low_y[n], high_y[n], j) * across[n];
    }
    for (uint n = 0; n < count; n++) mean[n] /= (high_x[n] - low_x[n]) * (high_y[n] - low_y[n]); // as rounded: it may be far below a pixel
}

#endif
