// Whether a block has seen enough points of the aperture: what its photosites found over half of the points so far and over all of
// them differs by less than is allowed, root mean square over the block (occlusion.cl).
#ifndef AGREEMENT_H
#define AGREEMENT_H
#include "conventions.h"

struct sampling {
    uint patch_rows;      // of `windows`
    uint point_count;     // most points of a block
    uint least;           // points after which means are compared for the first time, a power of two; they are again at each power of two
    uint first_color;     // of mosaic_colors.h
    uint normalise;       // 1: light is divided by the share of rays that meet a surface, so that rays that meet none do not darken it
    float brightest;      // light from which on a photosite's own sample may be a lamp [e- s^-1 um^-2 sr^-1]
    float slope, offset;  // allowed squared difference [(e- s^-1 um^-2 sr^-1)^2]: slope * light + offset
};

// A squared difference over that allowed at this light.
INLINE float allowed_part(const float off, const float light, const struct sampling by) {
    return off * off / (by.slope * (light > 0.0f ? light : 0.0f) + by.offset);
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
