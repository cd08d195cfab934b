// Adds the light of a slab of a layer, seen through one point of the aperture, to the photosites of a work-item (occlusion.cl).
#ifndef SLAB_LIGHT_H
#define SLAB_LIGHT_H
#include "conventions.h"
#include "slab_samples.h"
#if SPAN >= 16 // one vector of 16 floats: some compilers halve it, and compute the addresses of all samples twice
#define LANES _Pragma("clang loop vectorize_width(16) interleave_count(1)")
#else
#define LANES
#endif

// State of the photosites' rays through this point, and sums over points; ALL each.
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
INLINE float mix(global const float *plane, const struct weights w, const struct slab_samples at, const long element, const uint down, const uint across) {
    global const float *a = plane + at.rows[2 * down] + element, *c = plane + at.rows[2 * down + 1] + element;
    const long left = at.columns[2 * across], right = at.columns[2 * across + 1];
    return w.a * a[left] + w.b * a[right] + w.c * c[left] + w.d * c[right];
}

// Add the slab's light to photosite m of the set in an odd or even row and column; returns the share of its ray that is left.
// OPAQUE 1: only the last layer has a coverage below 1. The share that missed all slabs so far, of whatever layer, is the share that
// passes on, and no other state is needed; all_seen is less the share that has met any slab. fresh: whether this is the first slab
// that the rays meet, before which that state is not read.
INLINE float add_ray(const int partial, const int fresh, const uint m, const struct weights w, const struct slab_samples at,
                     const struct ray_state ray, const long element, const uint down, const uint across) {
    const float met = w.a + w.b + w.c + w.d, cover = partial ? mix(at.coverage, w, at, element, down, across) : met;
    const float missed = OPAQUE && fresh ? 1.0f : ray.missed[m], open = OPAQUE ? missed : ray.before[m] * missed, left = missed - missed * met;
    const float more = mix(at.light[2 * down + across], w, at, element, down, across) - ray.sharp[m] * cover;
    ray.all[m] += open * more;
    if (OPAQUE && partial) ray.all_seen[m] += open * (cover - met);
    if (!OPAQUE) ray.all_seen[m] += open * cover, ray.covered[m] += missed * cover;
    if (CORRECTION) ray.sum[m] += missed * more, ray.seen[m] += missed * cover;
    ray.missed[m] = left;
    return left;
}

// Add the slab's light. mapped: whether any sample may lie outside the slab, else all rays meet it. partial: whether any coverage is
// below 1.
INLINE void add_slab(const int mapped, const int partial, const int fresh, const struct slab_samples first, const struct ray_state ray) {
    __attribute__((opencl_unroll_hint(ROWS))) // else compilers keep 25 addresses on the stack and step all of them
    for (uint j = 0; j < ROWS; j++) {
        const struct slab_samples at = GROWS ? on_row(first, j) : first;
        const struct weights all = {at.wa, at.wb, at.wc, at.wd};
        LANES
        for (uint i = 0; i < SPAN; i++) {
            const long e = j * at.next + i;
            const uint m = j * SPAN + i;
            const struct weights w0 = mapped ? weigh(at, e, 0, 0) : all, w1 = mapped ? weigh(at, e, 0, 1) : all;
            const struct weights w2 = mapped ? weigh(at, e, 1, 0) : all, w3 = mapped ? weigh(at, e, 1, 1) : all;
            const float left0 = add_ray(partial, fresh, m, w0, at, ray, e, 0, 0), left1 = add_ray(partial, fresh, m + SIZE, w1, at, ray, e, 0, 1);
            const float left2 = add_ray(partial, fresh, m + 2 * SIZE, w2, at, ray, e, 1, 0), left3 = add_ray(partial, fresh, m + 3 * SIZE, w3, at, ray, e, 1, 1);
            const float even = left0 > left1 ? left0 : left1, odd = left2 > left3 ? left2 : left3, most = even > odd ? even : odd;
            if (mapped) ray.unmet[i] |= most > 1e-3f ? 1u : 0u;
        }
    }
}

// `add_slab` compiled for each case, so that no more is read than it needs.
INLINE void add_case(const int mapped, const int partial, const int fresh, const struct slab_samples at, const struct ray_state ray) {
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
