// Adds the light of a slab of a layer, seen through one point of the aperture, to the photosites of a work-item (occlusion.cl).
#ifndef SLAB_LIGHT_H
#define SLAB_LIGHT_H
#include "conventions.h"
#include "slab_samples.h"

// Blur circles that lie inside their sample do not blur where one sample is a photosite. Light that a photosite's own samples see apart
// is blurred by any.
#define SHARP_PX (MOTION + OVER == 1 ? 0.5f : 0.0f)

// State of the photosites' rays through this point, and sums over points; ALL each, of light COLORS times ALL.
struct ray_state {
    float *before, *missed, *covered; // share of light that passes the layers in front; share that missed this layer so far; its coverage
    float *all, *all_seen;            // sums of light and of coverage, composited
    float *sum, *seen;                // the same of this layer alone
    uint *open;                       // ROWS; whether a ray of the row is left
    uint *begun;                      // ROWS; OPAQUE 1: whether a ray of the row has met a slab
    const float *sharp;               // light of the photosite's own sample, of a lamp less, from which sums are counted
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

#define LEAST_LEFT 1e-3f // share of a ray up to which it ends: each by itself, so that light does not depend on which ones a work-item has

// Add the slab's light to photosite m of a set; returns the share of its ray that is left.
// OPAQUE 1: only the last layer has a coverage below 1. The share that missed all slabs so far, of whatever layer, is the share that
// passes on, and no other state is needed; all_seen is less the share that has met any slab. fresh: whether this is the first slab
// that the row's rays meet, before which that state is not read.
INLINE float add_ray(const int partial, const int fresh, const uint m, const struct weights w, const struct slab_samples at,
                     const struct ray_state ray, const struct spot spot, const uint set) {
    const float met = w.a + w.b + w.c + w.d, cover = partial ? mix(at.coverage, w, spot) : met;
    const float missed = OPAQUE && fresh ? 1.0f : ray.missed[m], open = OPAQUE ? missed : ray.before[m] * missed;
    const float rest = missed - missed * met, least = MOTION && rest < 0.0f ? rest : 0.0f; // below 0: light is continued beyond samples
    const float left = rest > LEAST_LEFT ? rest : least;
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

// Add to the coverage of an opaque scene what the rays of each row have met that has met a slab.
INLINE void add_seen(const uint *begun, const float *missed, float *all_seen) {
    for (uint j = 0; j < ROWS; j++) {
        if (!begun[j]) continue;
        for (uint set = 0; set < SETS; set++)
            for (uint m = set * SIZE + j * SPAN; m < set * SIZE + j * SPAN + SPAN; m++) all_seen[m] += 1.0f - missed[m];
    }
}

#endif
