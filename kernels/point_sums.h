// Sums over points of the aperture of a work-item's photosites, and the light that they found (occlusion.cl).
#ifndef POINT_SUMS_H
#define POINT_SUMS_H
#include "agreement.h"
#include "conventions.h"
#include "slab_light.h"

// Sums over points, SIZE by SIZE: of each layer, where CORRECTION is 1, and composited. Arrays of their own, so that compilers see that they
// do not overlap.
struct point_sums {
    const float *sum, *seen;     // COLORS * LAYERS * ALL: colour less coverage times `sharp`, for smaller rounding errors; LAYERS * ALL: coverage
    const float *all, *all_seen; // COLORS * ALL; ALL
};

// The sums of one of the colours.
INLINE struct point_sums sums_of(const struct point_sums of, const uint color) {
    const struct point_sums found = {of.sum + CORRECTION * color * LAYERS * ALL, of.seen, of.all + color * ALL, of.all_seen};
    return found;
}

// Mean light of a photosite over so many points, of the sums of light less coverage times `sharp` and of coverage.
INLINE float mean_light(const float all, const float seen, const float sharp, const uint count, const uint normalise) {
    return (all + sharp * seen) / (normalise ? (seen > 1e-6f ? seen : 1e-6f) : (float)count);
}

// What photosite m found over so many points: its mean light; CORRECTION 1: the light of the layers composited point by point less that
// of their means over the aperture, composited.
INLINE float found_light(const struct point_sums of, const uint m, const float sharp, const uint count, const uint normalise) {
    if (!CORRECTION) return mean_light(of.all[m], of.all_seen[m], sharp, count, normalise);
    float apart_sum = 0.0f, open = 1.0f; // of the layers' means, composited
    for (uint l = 0; l < LAYERS * CORRECTION; l++) {
        apart_sum += open * of.sum[l * ALL + m];
        open *= 1.0f - of.seen[l * ALL + m] / (float)count;
    }
    return (of.all[m] - apart_sum) / (float)count + sharp * (of.all_seen[m] / (float)count - (1.0f - open));
}

// Sum of the squared differences of a work-item's photosites between what they found and `kept`, over those allowed at their light;
// `kept` becomes what they found. It is counted in fours of neighbours, so that work-items of one such four each add up to the same bits.
INLINE float disagreement(const struct point_sums of, const float *sharp, float *kept, const uint count, const struct sampling by) {
    float off_all = 0.0f;
    for (uint i = 0; i < SIZE; i++) {
        float four = 0.0f;
        for (uint set = 0; set < SETS; set++) {
            const uint m = set * SIZE + i;
            const float mean = mean_light(of.all[m], of.all_seen[m], sharp[m], count, by.normalise);
            const float found = found_light(of, m, sharp[m], count, by.normalise), off = found - kept[m];
            four += allowed_part(off, mean, by);
            kept[m] = found;
        }
        off_all += four;
    }
    return off_all;
}

#endif
