// Adds the light of a slab of a layer, seen through one point of the aperture, to the photosites of a work-item (occlusion.cl).
#ifndef SLAB_LIGHT_H
#define SLAB_LIGHT_H
#include "conventions.h"
#include "lanes.h"
#include "slab_samples.h"

// Blur circles that lie inside their sample do not blur where one sample is a photosite. Light that a photosite's own samples see apart
// is blurred by any.
#define SHARP_PX (MOTION + OVER == 1 ? 0.5f : 0.0f)

// State of the photosites' rays through this point, and sums over points; ALL each, of light COLORS times ALL.
struct ray_state {
    float *before, *missed, *covered; // share of light that passes the layers in front; share that missed this layer so far; its coverage
    float *all, *all_seen;            // sums of light and of coverage, composited
    float *sum, *seen;                // the same of this layer alone
    uint *unmet;                      // SPAN; 1 where a photosite of the column has a ray that is left
    const float *sharp;               // light of the photosite's own sample, from which sums are counted
};

// Begin the next layer: the share of light that passes the layers in front is less by the coverage of the last one. fresh: none was met.
INLINE void begin_layer(const int fresh, float *before, float *missed, float *covered) {
    *before = fresh ? 1.0f : *before * (1.0f - *covered);
    *missed = 1.0f;
    *covered = 0.0f;
}

// Sum of a plane's samples by these weights.
INLINE float mix(global const float *plane, const struct weights w, const struct spot spot) {
    return w.a * plane[spot.a] + w.b * plane[spot.b] + w.c * plane[spot.c] + w.d * plane[spot.d];
}

// Add the slab's light to photosite m of a set; returns the share of its ray that is left.
// OPAQUE 1: only the last layer has a coverage below 1. The share that missed all slabs so far, of whatever layer, is the share that
// passes on, and no other state is needed; all_seen is less the share that has met any slab. fresh: whether this is the first slab
// that the rays meet, before which that state is not read.
INLINE float add_ray(const int partial, const int fresh, const uint m, const struct weights w, const struct slab_samples at,
                     const struct ray_state ray, const struct spot spot, const uint set) {
    const float met = w.a + w.b + w.c + w.d, cover = partial ? mix(at.coverage, w, spot) : met;
    const float missed = OPAQUE && fresh ? 1.0f : ray.missed[m], open = OPAQUE ? missed : ray.before[m] * missed, left = missed - missed * met;
    __attribute__((opencl_unroll_hint(COLORS)))
    for (uint c = 0; c < COLORS; c++) {
        const float more = mix(at.light[of_color(c, set)], w, spot) - ray.sharp[c * ALL + m] * cover;
        ray.all[c * ALL + m] += open * more;
        if (CORRECTION) ray.sum[c * LAYERS * ALL + m] += missed * more;
    }
    if (OPAQUE && partial) ray.all_seen[m] += open * (cover - met);
    if (!OPAQUE) ray.all_seen[m] += open * cover, ray.covered[m] += missed * cover;
    if (CORRECTION) ray.seen[m] += missed * cover;
    ray.missed[m] = left;
    return left;
}

// Add the slab's light to the photosites of row j. wide: of `spot_of`. mapped: whether any sample may lie outside the slab, else all rays meet
// it. partial: whether any coverage is below 1.
INLINE void add_row(const int wide, const int mapped, const int partial, const int fresh, const struct slab_samples at, const struct ray_state ray, const uint j) {
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
        if (mapped) ray.unmet[i] |= most > 1e-3f ? 1u : 0u;
    }
}

// Add the slab's light to all rows.
INLINE void add_slab(const int mapped, const int partial, const int fresh, const struct slab_samples first, const struct ray_state ray) {
    __attribute__((opencl_unroll_hint(ROWS))) // else compilers keep 25 addresses on the stack and step all of them
    for (uint j = 0; j < ROWS; j++) add_row(0, mapped, partial, fresh, GROWS ? on_row(first, j) : first, ray, j);
}

// `add_slab` compiled for each case, so that no more is read than it needs. Where photosites look apart, which is dear, for two of them.
// Only an opaque scene asks whether a slab is the first: else there are half as many cases to compile.
INLINE void add_case(const int mapped, const int partial, const int first, const struct slab_samples at, const struct ray_state ray) {
    const bool fresh = OPAQUE && first;
#if TURNS
    if (at.view.wide) {
        __attribute__((opencl_unroll_hint(1)))
        for (uint j = 0; j < ROWS; j++) {
            if (mapped) add_row(1, 1, COVERAGE, fresh, at, ray, j);
            else add_row(1, 0, COVERAGE, fresh, at, ray, j);
        }
        return;
    }
#endif
    if (mapped && partial && fresh) add_slab(1, 1, 1, at, ray);
    else if (mapped && partial) add_slab(1, 1, 0, at, ray);
    else if (mapped && fresh) add_slab(1, 0, 1, at, ray);
    else if (mapped) add_slab(1, 0, 0, at, ray);
    else if (partial && fresh) add_slab(0, 1, 1, at, ray);
    else if (partial) add_slab(0, 1, 0, at, ray);
    else if (fresh) add_slab(0, 0, 1, at, ray);
    else add_slab(0, 0, 0, at, ray);
}

#endif
