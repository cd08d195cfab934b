// Where a photosite would see if the lens did not distort: solves lateral * distort(undistorted) = place by Newton's method.
// distort: x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and alike in y (Brown 1966), in units of
// DISTORTION_UNIT_PX from the centre. x, y: photosites from the sensor's upper left corner. What is searched is the way from the place
// seen to the undistorted one, which is small beside both: single precision keeps a photosite far from the centre as exact as near it.
// What is returned is the whole way, with that of the lateral magnification.
#ifndef DISTORTION_H
#define DISTORTION_H
#include "conventions.h"
#include "displacement.h"
#define LEAST_AREA 1e-3f // of an area as it is seen, over its own: far outside the sensor the polynomial folds, where no step is taken

// What a step of a, b adds to the distorted place, beside itself.
struct distorted {
    float bent_x, bent_y, xx, xy, yy;
};

INLINE struct distorted distort(const float a, const float b) {
    const float r2 = a * a + b * b, bent = r2 * (DISTORTION_K1 + r2 * (DISTORTION_K2 + r2 * DISTORTION_K3));
    const float slope = 2.0f * (DISTORTION_K1 + r2 * (2.0f * DISTORTION_K2 + r2 * 3.0f * DISTORTION_K3));
    const struct distorted found = {a * bent + 2.0f * DISTORTION_P1 * a * b + DISTORTION_P2 * (r2 + 2.0f * a * a),
                                    b * bent + 2.0f * DISTORTION_P2 * a * b + DISTORTION_P1 * (r2 + 2.0f * b * b),
                                    bent + slope * a * a + 2.0f * DISTORTION_P1 * b + 6.0f * DISTORTION_P2 * a,
                                    slope * a * b + 2.0f * DISTORTION_P1 * a + 2.0f * DISTORTION_P2 * b,
                                    bent + slope * b * b + 2.0f * DISTORTION_P2 * a + 6.0f * DISTORTION_P1 * b};
    return found;
}

// One over the area of a distorted square, over its own; 0 beyond a fold, and where a second one turns it over.
INLINE float shrunk(const struct distorted at) {
    const float area = (1.0f + at.xx) * (1.0f + at.yy) - at.xy * at.xy;
    return area > LEAST_AREA && at.xx > -1.0f ? 1.0f / area : 0.0f;
}

INLINE struct displacement undistort(const float x, const float y, const uint channel) {
    const float shrink = channel == 0 ? DISTORTION_SHRINK_0 : channel == 2 ? DISTORTION_SHRINK_2 : DISTORTION_SHRINK_1;
    const float lateral = channel == 0 ? DISTORTION_LATERAL_0 : channel == 2 ? DISTORTION_LATERAL_2 : DISTORTION_LATERAL_1;
    const float from_x = x - DISTORTION_CENTRE_X, from_y = y - DISTORTION_CENTRE_Y;
    const float seen_x = from_x * shrink, seen_y = from_y * shrink;
    float way_x = 0.0f, way_y = 0.0f;
    __attribute__((opencl_unroll_hint(DISTORTION_STEPS)))
    for (uint step = 0; step < DISTORTION_STEPS; step++) {
        const struct distorted at = distort(seen_x + way_x, seen_y + way_y);
        const float scale = shrunk(at), miss_x = way_x + at.bent_x, miss_y = way_y + at.bent_y;
        way_x -= scale * ((1.0f + at.yy) * miss_x - at.xy * miss_y);
        way_y -= scale * ((1.0f + at.xx) * miss_y - at.xy * miss_x);
    }
    const struct distorted at = distort(seen_x + way_x, seen_y + way_y);
    const float scale = shrunk(at) * (1.0f + lateral), twist = at.xx * at.yy - at.xy * at.xy;
    const struct displacement found = {from_x * lateral + way_x * DISTORTION_UNIT_PX, from_y * lateral + way_y * DISTORTION_UNIT_PX,
                                       lateral - scale * (at.xx + twist), -scale * at.xy, -scale * at.xy,
                                       lateral - scale * (at.yy + twist)};
    return found;
}

#endif
