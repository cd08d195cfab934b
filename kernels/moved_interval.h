// Shares of pixels in the mean over an interval that is moved by all displacements of a range.
#ifndef MOVED_INTERVAL_H
#define MOVED_INTERVAL_H
#include "plain_math.h"

// Mean of max(place + t, 0) over t from -half to half.
INLINE float ramp(const float place, const float range) {
    const float above = place + range, bent = above * above / (4.0f * range);
    return place >= range ? place : (above > 0.0f ? bent : 0.0f);
}

// Share of each of TAPS pixels in the mean over the interval of width `wide` that begins at `low`, moved by all of -range
// to range [px from the start of the first pixel].
INLINE void overlaps(const float low, const float wide, const float range, float *shares) {
    const float moved = larger(range, 1.0e-6f);
    float before = ramp(low + wide, moved) - ramp(low, moved);
    for (uint i = 0; i < TAPS; i++) {
        const float number = (float)(i + 1), after = ramp(low + wide - number, moved) - ramp(low - number, moved);
        shares[i] = (before - after) / wide;
        before = after;
    }
}

#endif
