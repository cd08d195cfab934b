// Mean of the scene over the area of a photosite, or of a sample of one. Beyond the scene's grid its edge pixels continue.
// TAPS > 0, a scene finer than the photosites, or whose nearest pixel counts: a scene pixel is an even square, and the mean is exact.
// Where a lens distorts or the camera is posed, the area is a parallelogram, of SPLIT x SPLIT upright rectangles: of a pose those with
// the variance of their part along both axes. One touches at most TAPS pixels on either axis.
// TAPS 0, a scene of one pixel per photosite or fewer: the mean of SAMPLES x SAMPLES parts of the area, each at most one pixel wide.
// BENDS 1, of fewer: the exact mean of bilinear light (bilinear_area.h). BENDS 0, of one: the bilinear value at the middle of a part,
// which is the mean of even squares over one scene pixel's area.
#ifndef PHOTOSITE_AREA_H
#define PHOTOSITE_AREA_H
#include "bilinear_area.h"
#include "plain_math.h"
#include "seen_area.h"

// Part of pixel `number` [counted from `first`] that lies between `low` and `high` [px from the start of `first`].
INLINE float overlap(const float low, const float high, const uint number) {
    const float part = smaller(high, (float)(number + 1)) - larger(low, (float)number);
    return part > 0.0f ? part : 0.0f;
}

#if TAPS
// Mean of a plane over an area of the scene.
INLINE float area_mean(global const float *plane, const struct area seen, const struct projection p) {
    const struct area area = upright(seen);
    const float wide = extent(area.wide, area.tilt_right) * (1.0f / SPLIT), tall = extent(area.tall, area.tilt_down) * (1.0f / SPLIT);
    float sum = 0.0f, left, top;
    for (uint part = 0; part < SPLIT * SPLIT; part++) {
        part_of(area, wide, tall, part, &left, &top);
        const int column = whole(left), row = whole(top);
        const float low_x = left - (float)column, low_y = top - (float)row, high_x = low_x + wide, high_y = low_y + tall;
        float whole_part = 0.0f;
        __attribute__((opencl_unroll_hint(TAPS)))
        for (uint j = 0; j < TAPS; j++) {
            global const float *line = plane + (size_t)clamped(area.row + row + (int)j, p.scene_height) * p.scene_width;
            float across = 0.0f;
            for (uint i = 0; i < TAPS; i++)
                across += overlap(low_x, high_x, i) * line[clamped(area.column + column + (int)i, p.scene_width)];
            whole_part += overlap(low_y, high_y, j) * across;
        }
        sum += whole_part / ((high_x - low_x) * (high_y - low_y));  // as rounded: a part may be far smaller than a pixel
    }
    return sum * (1.0f / (SPLIT * SPLIT));
}
#endif

#endif
