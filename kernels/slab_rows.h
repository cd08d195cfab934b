// Adds the light of a slab of a layer, seen through one point of the aperture, to the rows of photosites that meet it (occlusion.cl).
#ifndef SLAB_ROWS_H
#define SLAB_ROWS_H
#include "conventions.h"
#include "lanes.h"
#include "slab_light.h"
#include "slab_samples.h"

// How many of a photosite's four samples lie in the slab.
INLINE float count_inside(const struct slab_samples at, const struct spot spot) {
    return inside(at.radius[spot.a], at, 1.0f) + inside(at.radius[spot.b], at, 1.0f) + inside(at.radius[spot.c], at, 1.0f) + inside(at.radius[spot.d], at, 1.0f);
}

// Whether a ray of row j may meet the slab; else none of its light need be read. MOTION 1: rays meet slabs beside which their samples lie, too.
INLINE uint meets_row(const struct slab_samples at, const uint j) {
    uint met = MOTION;
    LANES
    for (uint i = 0; i < SPAN; i++) {
        const float all = count_inside(at, spot_of(0, at, i, j, 0, 0)) + count_inside(at, spot_of(0, at, i, j, 0, 1)) +
            count_inside(at, spot_of(0, at, i, j, 1, 0)) + count_inside(at, spot_of(0, at, i, j, 1, 1));
        met |= all > 0.0f ? 1u : 0u;
    }
    return met;
}

// Add the slab's light to the photosites of row j; returns whether a ray of theirs is left. wide: of `spot_of`. mapped: whether any sample
// may lie outside the slab, else all rays meet it. partial: whether any coverage is below 1.
INLINE uint add_row(const int wide, const int mapped, const int partial, const int fresh, const struct slab_samples at, const struct ray_state ray, const uint j) {
    uint left = 0u;
    LANES
    for (uint i = 0; i < SPAN; i++) {
        const uint m = j * SPAN + i;
        const struct spot s0 = spot_of(wide, at, i, j, 0, 0), s1 = spot_of(wide, at, i, j, 0, 1);
        const struct spot s2 = spot_of(wide, at, i, j, 1, 0), s3 = spot_of(wide, at, i, j, 1, 1);
        const struct weights w0 = mapped ? weigh(at, s0) : s0.all, w1 = mapped ? weigh(at, s1) : s1.all;
        const struct weights w2 = mapped ? weigh(at, s2) : s2.all, w3 = mapped ? weigh(at, s3) : s3.all;
        const float left0 = add_ray(partial, fresh, m, w0, at, ray, s0, 0), left1 = add_ray(partial, fresh, m + SIZE, w1, at, ray, s1, 1);
        const float left2 = add_ray(partial, fresh, m + 2 * SIZE, w2, at, ray, s2, 2), left3 = add_ray(partial, fresh, m + 3 * SIZE, w3, at, ray, s3, 3);
        const float even = left0 > left1 ? left0 : left1, odd = left2 > left3 ? left2 : left3, most = even > odd ? even : odd;
        left |= most > 0.0f ? 1u : 0u;
    }
    return mapped ? left : 0u;
}

// Add the slab's light to a row that has rays left. Only an opaque scene asks whether a slab is the first one that a row meets: else
// there are half as many cases to compile.
INLINE void add_open_row(const int mapped, const int partial, const struct slab_samples at, const struct ray_state ray, const uint j) {
    if (OPAQUE && !ray.begun[j]) ray.open[j] = add_row(0, mapped, partial, 1, at, ray, j);
    else ray.open[j] = add_row(0, mapped, partial, 0, at, ray, j);
    ray.begun[j] = 1u;
}

// Add the slab's light to all rows that have rays left and meet it. Rows below one that meets it are not asked, since most do. UNROLLED:
// 1, or ROWS: each is compiled by itself, which takes compilers twice as long; else they keep 25 addresses on the stack and step them all.
INLINE void add_slab(const int partial, const struct slab_samples first, const struct ray_state ray) {
    uint meets = 0u;
    __attribute__((opencl_unroll_hint(UNROLLED)))
    for (uint j = 0; j < ROWS; j++) {
        const struct slab_samples at = GROWS ? on_row(first, j) : first;
        if (!ray.open[j] || (!meets && !meets_row(at, j))) continue;
        meets = 1u;
        add_open_row(1, partial, at, ray, j);
    }
}

// The same of a slab in which all samples lie, and that all rays meet.
INLINE void add_whole_slab(const int partial, const struct slab_samples first, const struct ray_state ray) {
    __attribute__((opencl_unroll_hint(UNROLLED)))
    for (uint j = 0; j < ROWS; j++)
        if (ray.open[j]) add_open_row(0, partial, GROWS ? on_row(first, j) : first, ray, j);
}

// Both compiled for each case, so that no more is read than it needs. Where photosites look apart, which is dear, for two of them.
INLINE void add_case(const int mapped, const int partial, const struct slab_samples at, const struct ray_state ray) {
#if TURNS
    if (at.view.wide) {
        __attribute__((opencl_unroll_hint(1)))
        for (uint j = 0; j < ROWS; j++) {
            if (!ray.open[j]) continue;
            const int fresh = OPAQUE && !ray.begun[j];
            if (mapped) ray.open[j] = add_row(1, 1, COVERAGE, fresh, at, ray, j);
            else ray.open[j] = add_row(1, 0, COVERAGE, fresh, at, ray, j);
            ray.begun[j] = 1u;
        }
        return;
    }
#endif
    if (mapped && partial) add_slab(1, at, ray);
    else if (mapped) add_slab(0, at, ray);
    else if (partial) add_whole_slab(1, at, ray);
    else add_whole_slab(0, at, ray);
}

#endif
