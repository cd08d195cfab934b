// Where in the scene a place on the sensor sees: through the distortion of the lens, the pose of the camera and the scale of the
// scene. POSE 1: the camera or the surface has moved, which is a homography of places x, y from the pivot [photosites]. It is kept as
// the displacement that it causes, so that single precision loses nothing where that is small:
//   dx = (pose[0] + pose[1] x + pose[2] y - x (pose[6] x + pose[7] y)) / (1 + pose[6] x + pose[7] y)
// and dy alike from pose[3] to pose[5].
#ifndef SCENE_PLACE_H
#define SCENE_PLACE_H
#include "conventions.h"
#if DISTORTION
#include "distortion.h"
#endif
#define POSE_NUMBERS 10
#define PLACE_BITS 40 // of the fraction of a place in fixed point
#define WHOLE_BITS 14 // of the fraction of the whole part of a number in two parts

// A number in two parts [px]: `whole` 2^-WHOLE_BITS, and what is left. The product of the former with the number of a sample fits an int.
struct parted {
    int whole;
    float rest;
};

// Where the sensor lies in the scene. Kernels take it as scalars: PoCL 3.1 vectorises over work-items 1.6 times worse with a struct.
struct projection {
    uint scene_width, scene_height; // of the scene's grid [px]
    float scale;                    // scene pixels per photosite
    float offset_x, offset_y;       // scene position of the sensor's upper left corner [px]
    long step, start_x, start_y;    // in fixed point [2^-PLACE_BITS px]: of one of OVER samples of a photosite; offset_x and offset_y
    struct parted wide, left;       // step and start_x of a scene of one pixel per photosite or fewer, where compilers make vectors of ints
#if POSE
    float pivot_x, pivot_y;         // photosites from the sensor's upper left corner
    float pose[POSE_NUMBERS - 2];
#endif
};

// Fill in the pose: pivot x, y, then pose[0] to pose[7].
INLINE void take_pose(struct projection *projection, global const float *pose) {
#if POSE
    projection->pivot_x = pose[0];
    projection->pivot_y = pose[1];
    __attribute__((opencl_unroll_hint(POSE_NUMBERS - 2)))
    for (uint i = 0; i < POSE_NUMBERS - 2; i++) projection->pose[i] = pose[2 + i];
#endif
}

// A place along an axis of the scene: `past` right of where a pixel begins [px].
struct place {
    int pixel;
    float past;
};

INLINE long in_fixed_point(const float number, const float rest) {
    const float one = (float)(1L << PLACE_BITS);
    return (long)(number * one) + (long)(rest * one);
}

INLINE struct parted in_parts(const float number, const float rest) {
    const float one = (float)(1 << WHOLE_BITS);
    const int count = whole(number * one + 0.5f);
    const struct parted found = {count, (number - (float)count * (1.0f / one)) + rest};
    return found;
}

// Fill in the places: in fixed point, and those across a scene whose pixels are no even squares (TAPS 0) in two parts.
// rests: what float32 leaves of scale, offset_x and offset_y.
INLINE void take_rests(struct projection *p, global const float *rests) {
    p->step = in_fixed_point(p->scale, rests[0]) / OVER;
    p->start_y = in_fixed_point(p->offset_y, rests[2]);
#if TAPS
    p->start_x = in_fixed_point(p->offset_x, rests[1]);
#else
    p->wide = in_parts(p->scale * (1.0f / OVER), rests[0] * (1.0f / OVER));
    p->left = in_parts(p->offset_x, rests[1]);
#endif
}

// Where a sample begins: its number on the sensor counts, so that a window anywhere has the same bits, and none is lost far out.
INLINE struct place sample_place(const long start, const long step, const int sample) {
    const long at = start + step * (long)sample;
    const struct place found = {(int)(at >> PLACE_BITS), (float)(int)((at >> (PLACE_BITS - 23)) & 0x7FFFFF) * (1.0f / 8388608.0f)};
    return found;
}

// The same from numbers in two parts, `inset` right of where the sample begins [px].
INLINE struct place parted_place(const struct parted start, const struct parted step, const int sample, const float inset) {
    const int at = start.whole + step.whole * sample;
    const float past = (float)(at & ((1 << WHOLE_BITS) - 1)) * (1.0f / (1 << WHOLE_BITS));
    const struct place found = {at >> WHOLE_BITS, past + ((start.rest + step.rest * (float)sample) + inset)};
    return found;
}

// Turn a place on the sensor [photosites] into the scene position [px] that a channel sees there.
INLINE void scene_place(float *x, float *y, const uint channel, const struct projection p) {
#if DISTORTION
    undistort(x, y, channel);
#endif
#if POSE
    const float a = *x - p.pivot_x, b = *y - p.pivot_y, slope = p.pose[6] * a + p.pose[7] * b, shrink = 1.0f / (1.0f + slope);
    *x += (p.pose[0] + p.pose[1] * a + p.pose[2] * b - a * slope) * shrink;
    *y += (p.pose[3] + p.pose[4] * a + p.pose[5] * b - b * slope) * shrink;
#endif
    *x = p.offset_x + p.scale * *x;
    *y = p.offset_y + p.scale * *y;
}

#endif
