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

// The scene's area that is seen in a square of `size` photosites, `inset` right of and below the corner of a sample.
// column, row: of the sample on the sensor, OVER to a photosite. lens: displacement at its middle; not read where DISTORTION is 0.
INLINE struct area area_of(const int column, const int row, const float inset, const float size, const struct displacement lens,
                           const struct projection p) {
#if DISTORTION || POSE
    const float middle = inset + 0.5f * size, side = p.scale * size;
    const float x = (float)column * (1.0f / OVER) + middle, y = (float)row * (1.0f / OVER) + middle;
    const struct displacement way = moved_by_pose(x, y, DISTORTION ? lens : moved_by_lens(x, y, 0), p);
    struct place across, down;
    displaced_place(p.start_x, p.step, column, p.scale, middle, way.right, &across);
    displaced_place(p.start_y, p.step, row, p.scale, middle, way.down, &down);
    const float wide = side * (1.0f + way.right_x), tall = side * (1.0f + way.down_y);
    const struct area found = {across.pixel, down.pixel, across.past - 0.5f * wide, down.past - 0.5f * tall, wide, tall,
                               side * way.right_y, side * way.down_x};
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
    const float across = size_of(turned.wide), tilt = size_of(turned.tilt_right);
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

#endif
