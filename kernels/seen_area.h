// The area of the scene that a photosite, or a sample of one, sees: a parallelogram where a lens distorts or the camera is posed.
#ifndef SEEN_AREA_H
#define SEEN_AREA_H
#include "plain_math.h"
#include "scene_place.h"

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

// How far `way` times a step of so many photosites to the right and down leads in the scene, by an area of `size` photosites [px].
INLINE void step_over(const struct area seen, const float size, const float way, const float right, const float below, float *across,
                      float *down) {
    *across = seen.wide / size * way * right;
    *down = seen.tall / size * way * below;
#if POSE
    *across += seen.tilt_right / size * way * below;
    *down += seen.tilt_down / size * way * right;
#endif
}

#if TAPS
// Upper left corner of one of SPLIT x SPLIT parts of an area that is upright, each of which is `wide` and `tall` [px].
INLINE void part_of(const struct area area, const float wide, const float tall, const uint part, float *left, float *top) {
    const float m = (float)(part % SPLIT), n = (float)(part / SPLIT), middle = 0.5f * (SPLIT - 1);
    const float step_x = area.wide * (1.0f / SPLIT), step_y = area.tall * (1.0f / SPLIT);
    *left = area.left + 0.5f * (step_x - wide) + m * step_x + (n - middle) * (area.tilt_right * (1.0f / SPLIT));
    *top = area.top + 0.5f * (step_y - tall) + n * step_y + (m - middle) * (area.tilt_down * (1.0f / SPLIT));
}
#endif

#endif
