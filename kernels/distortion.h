// Where a photosite would see if the lens did not distort: solves lateral * distort(undistorted) = place by Newton's method.
// distort: x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and alike in y (Brown 1966), in units of
// DISTORTION_UNIT_PX from the centre. x, y: photosites from the sensor's upper left corner. What is searched is the way from the place
// seen to the undistorted one, which is small beside both: single precision keeps a photosite far from the centre as exact as near it.
// right, down: the whole way [photosites], with that of the lateral magnification.
#ifndef DISTORTION_H
#define DISTORTION_H
#include "conventions.h"
#define LEAST_AREA 1e-3f // of an area as it is seen, over its own: far outside the sensor the polynomial folds, where no step is taken

INLINE void undistort(const float x, const float y, const uint channel, float *right, float *down) {
    const float shrink = channel == 0 ? DISTORTION_SHRINK_0 : channel == 2 ? DISTORTION_SHRINK_2 : DISTORTION_SHRINK_1;
    const float lateral = channel == 0 ? DISTORTION_LATERAL_0 : channel == 2 ? DISTORTION_LATERAL_2 : DISTORTION_LATERAL_1;
    const float from_x = x - DISTORTION_CENTRE_X, from_y = y - DISTORTION_CENTRE_Y;
    const float seen_x = from_x * shrink, seen_y = from_y * shrink;
    float way_x = 0.0f, way_y = 0.0f;
    __attribute__((opencl_unroll_hint(DISTORTION_STEPS)))
    for (uint step = 0; step < DISTORTION_STEPS; step++) {
        const float a = seen_x + way_x, b = seen_y + way_y, r2 = a * a + b * b;
        const float bent = r2 * (DISTORTION_K1 + r2 * (DISTORTION_K2 + r2 * DISTORTION_K3)), radial = 1.0f + bent;
        const float slope = 2.0f * (DISTORTION_K1 + r2 * (2.0f * DISTORTION_K2 + r2 * 3.0f * DISTORTION_K3));
        const float miss_x = way_x + (a * bent + 2.0f * DISTORTION_P1 * a * b + DISTORTION_P2 * (r2 + 2.0f * a * a));
        const float miss_y = way_y + (b * bent + 2.0f * DISTORTION_P2 * a * b + DISTORTION_P1 * (r2 + 2.0f * b * b));
        const float xx = radial + slope * a * a + 2.0f * DISTORTION_P1 * b + 6.0f * DISTORTION_P2 * a;
        const float xy = slope * a * b + 2.0f * DISTORTION_P1 * a + 2.0f * DISTORTION_P2 * b;
        const float yy = radial + slope * b * b + 2.0f * DISTORTION_P2 * a + 6.0f * DISTORTION_P1 * b;
        const float area = xx * yy - xy * xy, scale = area > LEAST_AREA ? 1.0f / area : 0.0f;
        way_x -= scale * (yy * miss_x - xy * miss_y);
        way_y -= scale * (xx * miss_y - xy * miss_x);
    }
    *right = from_x * lateral + way_x * DISTORTION_UNIT_PX;
    *down = from_y * lateral + way_y * DISTORTION_UNIT_PX;
}

#endif
