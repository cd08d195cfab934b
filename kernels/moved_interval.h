// Shares of pixels in means over intervals that are moved by all displacements of a range, those of a span of photosites at once.
#ifndef MOVED_INTERVAL_H
#define MOVED_INTERVAL_H
#include "lanes.h"
#include "ramp.h"

// Each is `wide` about a middle, and moved by all of -range to range [px, the middle from the start of the first pixel]. LEANS 1: what lies
// farther right in it, or has moved farther, is moved by so much along the other axis.
struct intervals {
    float middle[SPAN], wide[SPAN], range[SPAN], slope[SPAN], moved_slope[SPAN];
};

// share: (TAPS, SPAN), of each pixel in the mean. LEANS 1: shift: how it changes where the interval moves by a pixel; aside: how far
// what lies in the pixel is moved along the other axis, times its share [px].
INLINE void shares_of(const struct intervals *at, float (*share)[SPAN], float (*shift)[SPAN], float (*aside)[SPAN]) {
    float part[SPAN], density[SPAN], first[SPAN], bend[SPAN], per[SPAN];
    LANES
    for (uint n = 0; n < SPAN; n++) {
        part[n] = density[n] = first[n] = 0.0f; // nothing lies left of the first pixel
        bend[n] = 0.25f / at->range[n], per[n] = 1.0f / at->wide[n];
    }
    for (uint i = 0; i < TAPS; i++) {
        LANES
        for (uint n = 0; n < SPAN; n++) {
            const float border = (float)(i + 1) - at->middle[n], low = border - 0.5f * at->wide[n], high = border + 0.5f * at->wide[n];
            const float range = at->range[n], after = ramp(high, range, bend[n]), earlier = ramp(low, range, bend[n]);
            const float to = (after - earlier) * per[n];
            share[i][n] = to - part[n];
            part[n] = to;
#if LEANS
            const float here = smaller(larger(high, -range), range) - smaller(larger(low, -range), range);
            const float own = here * 2.0f * bend[n] * per[n];
            const float both = (slide(high, range, bend[n]) - slide(low, range, bend[n])) * per[n];
            const float inside = both - 0.5f * (after + earlier); // the mean place in the interval, of what lies left of the border
            const float mean = at->slope[n] * inside + at->moved_slope[n] * (border * to - both - inside);
            shift[i][n] = density[n] - own, aside[i][n] = mean - first[n];
            density[n] = own, first[n] = mean;
#endif
        }
    }
}

#endif
