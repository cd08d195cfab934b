// Where in the scene a place on the sensor sees: through the distortion of the lens, the pose of the camera and the scale of the
// scene. POSE 1: the camera or the surface has moved, which is a homography of places x, y from the pivot [photosites]. It is kept as
// the displacement that it causes, so that single precision loses nothing where that is small:
//   dx = (pose[0] + pose[1] x + pose[2] y - x (pose[6] x + pose[7] y)) / (1 + pose[6] x + pose[7] y)
// and dy alike from pose[3] to pose[5].
#ifndef SCENE_PLACE_H
#define SCENE_PLACE_H
#include "conventions.h"
#include "displacement.h"
#include "fixed_place.h"
#if DISTORTION
#include "distortion.h"
#endif
#define POSE_NUMBERS 10

// Where the sensor lies in the scene. Kernels take it as scalars: PoCL 3.1 vectorises over work-items 1.6 times worse with a struct.
struct projection {
    uint scene_width, scene_height; // of the scene's grid [px]
    float scale;                    // scene pixels per photosite
    float offset_x, offset_y;       // scene position of the sensor's upper left corner [px]
    long step, start_x, start_y;    // in fixed point [2^-PLACE_BITS px]: of one of OVER samples of a photosite; offset_x and offset_y
    struct parted wide, left;       // step and start_x where nothing displaces photosites and TAPS is 0: compilers make vectors of ints
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

// Fill in the places in fixed point, and those across in two parts. rests: what float32 leaves of scale, offset_x and offset_y.
INLINE void take_rests(struct projection *p, const float *rests) {
    p->step = in_fixed_point(p->scale, rests[0]) / OVER;
    p->start_x = in_fixed_point(p->offset_x, rests[1]), p->start_y = in_fixed_point(p->offset_y, rests[2]);
    p->wide = in_parts(p->scale * (1.0f / OVER), rests[0] * (1.0f / OVER));
    p->left = in_parts(p->offset_x, rests[1]);
}

// Projection of a kernel's arguments. pose: POSE_NUMBERS of the pose, then what float32 leaves of scale, offset_x, offset_y.
INLINE struct projection projection_of(const uint scene_width, const uint scene_height, const float scale, const float offset_x,
                                       const float offset_y, global const float *pose) {
    const float rests[3] = {pose[POSE_NUMBERS], pose[POSE_NUMBERS + 1], pose[POSE_NUMBERS + 2]};
    struct projection found = {scene_width, scene_height, scale, offset_x, offset_y};
    take_rests(&found, rests);
    take_pose(&found, pose);
    return found;
}

// How far the lens moves what a channel sees at a place on the sensor [photosites].
INLINE struct displacement moved_by_lens(const float x, const float y, const uint channel) {
#if DISTORTION
    return undistort(x, y, channel);
#else
    const struct displacement none = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    return none;
#endif
}

// The same of the lens, as it is given, and then the pose.
INLINE struct displacement moved_by_pose(const float x, const float y, const struct displacement lens, const struct projection p) {
#if POSE
    const float a = (x - p.pivot_x) + lens.right, b = (y - p.pivot_y) + lens.down, slope = p.pose[6] * a + p.pose[7] * b;
    const float shrink = 1.0f / (1.0f + slope);
    const float right = (p.pose[0] + p.pose[1] * a + p.pose[2] * b - a * slope) * shrink;
    const float down = (p.pose[3] + p.pose[4] * a + p.pose[5] * b - b * slope) * shrink;
    const struct displacement pose = {right, down,
                                      (p.pose[1] - slope - (a + right) * p.pose[6]) * shrink, (p.pose[2] - (a + right) * p.pose[7]) * shrink,
                                      (p.pose[4] - (b + down) * p.pose[6]) * shrink, (p.pose[5] - slope - (b + down) * p.pose[7]) * shrink};
    return followed_by(lens, pose);
#else
    return lens;
#endif
}

// Scene position [px] that a channel sees at a place on the sensor [photosites], as one number: for what varies little between pixels.
INLINE void scene_place(float *x, float *y, const uint channel, const struct projection p) {
    const struct displacement way = moved_by_pose(*x, *y, moved_by_lens(*x, *y, channel), p);
    *x = p.offset_x + p.scale * (*x + way.right);
    *y = p.offset_y + p.scale * (*y + way.down);
}

#endif
