// Means of ramps over a range of displacements, which round off their corner.
#ifndef RAMP_H
#define RAMP_H
#include "plain_math.h"
#define LEAST_RANGE 1.0e-6f // [px], by which is divided

// Mean of max(place + t, 0) over t from -range to range. bend: 1 / (4 range).
INLINE float ramp(const float place, const float range, const float bend) {
    const float above = smaller(larger(place, -range), range) + range;
    return above * above * bend + larger(place - range, 0.0f);
}

// Its integral over the place: the mean of max(place + t, 0)^2 / 2.
INLINE float slide(const float place, const float range, const float bend) {
    const float above = smaller(larger(place, -range), range) + range, past = larger(place - range, 0.0f);
    return above * above * above * bend * (1.0f / 3.0f) + past * (range + 0.5f * past);
}

#endif
