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
#include "scene_place.h"

// Part of pixel `number` [counted from `first`] that lies between `low` and `high` [px from the start of `first`].
INLINE float overlap(const float low, const float high, const uint number) {
    const float part = smaller(high, (float)(number + 1)) - larger(low, (float)number);
    return part > 0.0f ? part : 0.0f;
}

struct area {
    int column, row;                // pixel from which it is counted
    float left, top, wide, tall;    // in the scene [px]
    float tilt_right, tilt_down;    // how far the lower side lies right of the upper, and the right side below the left [px]
};

#if DISTORTION || POSE
// Where a channel sees the scene at a place right of and below the corner of a sample [photosites]. column, row: of the sample on the
// sensor. x, y: become the place.
INLINE void see_at(const int column, const int row, const float right, const float below, const uint channel, const struct projection p,
                   struct place *x, struct place *y) {
    float way_x, way_y;
    displacement_of((float)column * (1.0f / OVER) + right, (float)row * (1.0f / OVER) + below, channel, p, &way_x, &way_y);
    displaced_place(p.start_x, p.step, column, p.scale, right, way_x, x);
    displaced_place(p.start_y, p.step, row, p.scale, below, way_y, y);
}

// How far a place lies right of or below another [px].
INLINE float apart_px(const struct place from, const struct place to) { return (float)(to.pixel - from.pixel) + (to.past - from.past); }
#endif

// The scene's area that a channel sees in a square of `size` photosites, `inset` right of and below the corner of a sample.
// column, row: of the sample on the sensor, OVER to a photosite.
INLINE struct area area_of(const int column, const int row, const float inset, const float size, const uint channel,
                           const struct projection p) {
#if DISTORTION || POSE
    const float middle = inset + 0.5f * size, end = inset + size;
    struct place left, left_y, right, right_y, top_x, top, bottom_x, bottom;
    see_at(column, row, inset, middle, channel, p, &left, &left_y);
    see_at(column, row, end, middle, channel, p, &right, &right_y);
    see_at(column, row, middle, inset, channel, p, &top_x, &top);
    see_at(column, row, middle, end, channel, p, &bottom_x, &bottom);
    const struct area found = {left.pixel, top.pixel, left.past, top.past, apart_px(left, right), apart_px(top, bottom),
                               apart_px(top_x, bottom_x), apart_px(left_y, right_y)};
#else
    const struct place x = sample_place(p.start_x, p.step, column), y = sample_place(p.start_y, p.step, row);
    const float left = x.past + p.scale * inset, top = y.past + p.scale * inset;
    const struct area found = {x.pixel, y.pixel, left, top, p.scale * size, p.scale * size, 0.0f, 0.0f};
#endif
    return found;
}

#if TAPS
// The same area with a width and a height above 0. Where the image is turned by more than 45 degrees another of its sides is uppermost.
INLINE struct area upright(const struct area turned) {
    struct area area = turned;
#if POSE
    const float across = turned.wide < 0.0f ? -turned.wide : turned.wide, tilt = turned.tilt_right < 0.0f ? -turned.tilt_right : turned.tilt_right;
    if (turned.wide > 0.0f && turned.tall > 0.0f && tilt <= across) return area;
    if (tilt > across) {
        area.wide = turned.tilt_right, area.tilt_right = turned.wide;
        area.tall = turned.tilt_down, area.tilt_down = turned.tall;
    }
    if (area.wide < 0.0f) area.wide = -area.wide, area.tilt_down = -area.tilt_down;
    if (area.tall < 0.0f) area.tall = -area.tall, area.tilt_right = -area.tilt_right;
    area.left = turned.left + 0.5f * (turned.wide - area.wide), area.top = turned.top + 0.5f * (turned.tall - area.tall);
#endif
    return area;
}

// Side of the upright rectangle with the variance of a parallelogram's area along an axis, of its two sides' steps along it [px]: that of
// a square, however far it is turned.
INLINE float extent(const float side, const float tilt) {
#if POSE
    const float squared = side * side + tilt * tilt;
    return squared * reciprocal_square_root(squared);
#else
    return side;
#endif
}

// Mean of a plane over an area of the scene.
INLINE float area_mean(global const float *plane, const struct area seen, const struct projection p) {
    const struct area area = upright(seen);
    const float step_x = area.wide * (1.0f / SPLIT), step_y = area.tall * (1.0f / SPLIT);
    const float wide = extent(area.wide, area.tilt_right) * (1.0f / SPLIT), tall = extent(area.tall, area.tilt_down) * (1.0f / SPLIT);
    const float first_left = area.left + 0.5f * (step_x - wide), first_top = area.top + 0.5f * (step_y - tall);
    float sum = 0.0f;
    for (uint part = 0; part < SPLIT * SPLIT; part++) {
        const float m = (float)(part % SPLIT), n = (float)(part / SPLIT), middle = 0.5f * (SPLIT - 1);
        const float left = first_left + m * step_x + (n - middle) * (area.tilt_right * (1.0f / SPLIT));
        const float top = first_top + n * step_y + (m - middle) * (area.tilt_down * (1.0f / SPLIT));
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
