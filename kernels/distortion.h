// Where a photosite would see if the lens did not distort: solves lateral * distort(undistorted) = place by Newton's method.
// distort: x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and alike in y (Brown 1966), in units of
// DISTORTION_UNIT_PX from the centre. x, y: photosites from the sensor's upper left corner, changed in place.
#ifndef DISTORTION_H
#define DISTORTION_H
#include "conventions.h"

INLINE void undistort(float *x, float *y, const uint channel) {
    const float shrink = channel == 0 ? DISTORTION_SHRINK_0 : channel == 2 ? DISTORTION_SHRINK_2 : DISTORTION_SHRINK_1;
    const float seen_x = (*x - DISTORTION_CENTRE_X) * shrink, seen_y = (*y - DISTORTION_CENTRE_Y) * shrink;
    float a = seen_x, b = seen_y;
    __attribute__((opencl_unroll_hint(DISTORTION_STEPS)))
    for (uint step = 0; step < DISTORTION_STEPS; step++) {
        const float r2 = a * a + b * b;
        const float radial = 1.0f + r2 * (DISTORTION_K1 + r2 * (DISTORTION_K2 + r2 * DISTORTION_K3));
        const float slope = 2.0f * (DISTORTION_K1 + r2 * (2.0f * DISTORTION_K2 + r2 * 3.0f * DISTORTION_K3));
        const float miss_x = a * radial + 2.0f * DISTORTION_P1 * a * b + DISTORTION_P2 * (r2 + 2.0f * a * a) - seen_x;
        const float miss_y = b * radial + 2.0f * DISTORTION_P2 * a * b + DISTORTION_P1 * (r2 + 2.0f * b * b) - seen_y;
        const float xx = radial + slope * a * a + 2.0f * DISTORTION_P1 * b + 6.0f * DISTORTION_P2 * a;
        const float xy = slope * a * b + 2.0f * DISTORTION_P1 * a + 2.0f * DISTORTION_P2 * b;
        const float yy = radial + slope * b * b + 2.0f * DISTORTION_P2 * a + 6.0f * DISTORTION_P1 * b;
        const float scale = 1.0f / (xx * yy - xy * xy);
        a -= scale * (yy * miss_x - xy * miss_y);
        b -= scale * (xx * miss_y - xy * miss_x);
    }
    *x = DISTORTION_CENTRE_X + a * DISTORTION_UNIT_PX;
    *y = DISTORTION_CENTRE_Y + b * DISTORTION_UNIT_PX;
}

#endif
