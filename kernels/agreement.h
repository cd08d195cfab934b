// Whether a block has seen enough points of the aperture: what its photosites found over half of the points so far and over all of
// them differs by less than is allowed, root mean square over the block (occlusion.cl).
#ifndef AGREEMENT_H
#define AGREEMENT_H
#include "conventions.h"
#include "slab_light.h"

struct sampling {
    uint patch_rows;      // of `windows`
    uint point_count;     // most points of a block
    uint least;           // points after which means are compared for the first time, a power of two; they are again at each power of two
    uint cfa;             // colour planes of the filter's pattern of 2 x 2 photosites [row][column], a byte each; a frame of any takes one build
    uint first_color;     // of mosaic_colors.h
    uint normalise;       // 1: light is divided by the share of rays that meet a surface, so that rays that meet none do not darken it
    float slope, offset;  // allowed squared difference [(e- s^-1 um^-2 sr^-1)^2]: slope * light + offset
};

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
            four += off * off / (by.slope * (mean > 0.0f ? mean : 0.0f) + by.offset);
            kept[m] = found;
        }
        off_all += four;
    }
    return off_all;
}

// Sum of a number over the WORKERS work-items of a block, in their order. parts: WORKERS.
INLINE float sum_over_block(const float own, local float *parts) {
#if WORKERS > 1
    float sum = 0.0f;
    parts[get_local_id(1) * get_local_size(0) + get_local_id(0)] = own;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = 0; i < WORKERS; i++) sum += parts[i];
    barrier(CLK_LOCAL_MEM_FENCE);
    return sum;
#else
    return own;
#endif
}

#endif
