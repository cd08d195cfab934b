// Whether a block has seen enough points of the aperture: the means of its photosites over half of the points so far and over all of
// them differ by less than is allowed, root mean square over the block (occlusion.cl).
#ifndef AGREEMENT_H
#define AGREEMENT_H
#include "conventions.h"
#include "slab_light.h"

struct sampling {
    uint patch_rows;      // of `windows`
    uint point_count;     // most points of a block
    uint least;           // points after which means are compared for the first time, a power of two; they are again at each power of two
    uint normalise;       // 1: light is divided by the share of rays that meet a surface, so that rays that meet none do not darken it
    float slope, offset;  // allowed squared difference [(e- s^-1 um^-2 sr^-1)^2]: slope * light + offset
};

// Mean light of a photosite over so many points, of the sums of light less coverage times `sharp` and of coverage.
INLINE float mean_light(const float all, const float seen, const float sharp, const uint count, const uint normalise) {
    return (all + sharp * seen) / (normalise ? (seen > 1e-6f ? seen : 1e-6f) : (float)count);
}

// Sum of the squared differences of a work-item's photosites between their means and `kept`, over those allowed; `kept` becomes the
// means. It is counted in fours of neighbours, so that work-items of one such four each add up to the same bits.
INLINE float disagreement(const float *all, const float *seen, const float *sharp, float *kept, const uint count, const struct sampling by) {
    float sum = 0.0f;
    for (uint i = 0; i < SIZE; i++) {
        float four = 0.0f;
        for (uint set = 0; set < SETS; set++) {
            const uint m = set * SIZE + i;
            const float mean = mean_light(all[m], seen[m], sharp[m], count, by.normalise), off = mean - kept[m];
            four += off * off / (by.slope * (mean > 0.0f ? mean : 0.0f) + by.offset);
            kept[m] = mean;
        }
        sum += four;
    }
    return sum;
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
