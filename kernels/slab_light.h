// Adds the light of a slab of a layer, seen through one point of the aperture, to photosites of one colour (occlusion.cl).
#ifndef SLAB_LIGHT_H
#define SLAB_LIGHT_H
#include "conventions.h"
#if SPAN >= 16 // one vector of 16 floats: some compilers halve it, and compute the addresses of all samples twice
#pragma clang diagnostic ignored "-Wpass-failed" // some cannot; they compute the same without it
#define LANES _Pragma("clang loop vectorize_width(16) interleave_count(1)")
#else
#define LANES
#endif
#define SIZE (ROWS * SPAN) // photosites: ROWS rows, two apart, of SPAN columns of a set

// The four samples around the place where each photosite's ray meets the slab, and their weights: a itself, b to the right, c below,
// d below to the right.
struct slab_samples {
    global const float *light, *coverage, *radius; // sample a of the first photosite
    long right, below, next;                       // elements to b, to c, and to the next row of photosites
    float wa, wb, wc, wd;                          // bilinear weights
    float least, most;                             // radii of the slab [photosites]
};

// State of the photosites' rays through this point, and sums over points; SIZE each.
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

// Weight of a sample in a slab: 0 outside its range of radii.
INLINE float inside(const float radius, const float low, const float high, const float weight) {
    return radius < low || radius >= high ? 0.0f : weight;
}

// Add the slab's light. mapped: whether any sample may lie outside the slab, else all rays meet it. partial: whether any coverage is
// below 1.
INLINE void add_slab(const int mapped, const int partial, const struct slab_samples at, const struct ray_state ray) {
    for (uint j = 0; j < ROWS; j++) {
        global const float *a = at.light + j * at.next, *b = a + at.right, *c = a + at.below, *d = b + at.below;
        global const float *ca = at.coverage + j * at.next, *cb = ca + at.right, *cc = ca + at.below, *cd = cb + at.below;
        global const float *ra = at.radius + j * at.next, *rb = ra + at.right, *rc = ra + at.below, *rd = rb + at.below;
        LANES
        for (uint i = 0; i < SPAN; i++) {
            const size_t m = j * SPAN + i;
            const float ma = mapped ? inside(ra[i], at.least, at.most, at.wa) : at.wa, mb = mapped ? inside(rb[i], at.least, at.most, at.wb) : at.wb;
            const float mc = mapped ? inside(rc[i], at.least, at.most, at.wc) : at.wc, md = mapped ? inside(rd[i], at.least, at.most, at.wd) : at.wd;
            const float met = ma + mb + mc + md, cover = partial ? ma * ca[i] + mb * cb[i] + mc * cc[i] + md * cd[i] : met;
            const float missed = ray.missed[m], open = ray.before[m] * missed;
            const float more = ma * a[i] + mb * b[i] + mc * c[i] + md * d[i] - ray.sharp[m] * cover;
            ray.all[m] += open * more;
            ray.all_seen[m] += open * cover;
            if (CORRECTION) ray.sum[m] += missed * more, ray.seen[m] += missed * cover;
            ray.covered[m] += missed * cover;
            ray.missed[m] = missed - missed * met;
            if (mapped) ray.unmet[i] |= missed - missed * met > 1e-3f ? 1u : 0u;
        }
    }
}

// The same where only the last layer has a coverage below 1: the share that missed all slabs so far, of whatever layer, is the share
// that passes on, and no other state is needed. all_seen: less the share that has met any slab. fresh: whether this is the first slab
// that the rays meet, before which the state is not read.
INLINE void add_opaque(const int mapped, const int partial, const int fresh, const struct slab_samples at, const struct ray_state ray) {
    for (uint j = 0; j < ROWS; j++) {
        global const float *a = at.light + j * at.next, *b = a + at.right, *c = a + at.below, *d = b + at.below;
        global const float *ca = at.coverage + j * at.next, *cb = ca + at.right, *cc = ca + at.below, *cd = cb + at.below;
        global const float *ra = at.radius + j * at.next, *rb = ra + at.right, *rc = ra + at.below, *rd = rb + at.below;
        LANES
        for (uint i = 0; i < SPAN; i++) {
            const size_t m = j * SPAN + i;
            const float ma = mapped ? inside(ra[i], at.least, at.most, at.wa) : at.wa, mb = mapped ? inside(rb[i], at.least, at.most, at.wb) : at.wb;
            const float mc = mapped ? inside(rc[i], at.least, at.most, at.wc) : at.wc, md = mapped ? inside(rd[i], at.least, at.most, at.wd) : at.wd;
            const float met = ma + mb + mc + md, open = fresh ? 1.0f : ray.missed[m], left = open - open * met;
            const float cover = partial ? ma * ca[i] + mb * cb[i] + mc * cc[i] + md * cd[i] : met;
            ray.all[m] += open * (ma * a[i] + mb * b[i] + mc * c[i] + md * d[i] - ray.sharp[m] * cover);
            if (partial) ray.all_seen[m] += open * (cover - met);
            ray.missed[m] = left;
            if (mapped) ray.unmet[i] |= left > 1e-3f ? 1u : 0u;
        }
    }
}

// `add_slab`, or `add_opaque` where OPAQUE is 1: compiled for each case, so that no more is read than it needs.
INLINE void add_case(const int mapped, const int partial, const int fresh, const struct slab_samples at, const struct ray_state ray) {
#if OPAQUE
    if (mapped && partial && fresh) add_opaque(1, 1, 1, at, ray);
    else if (mapped && partial) add_opaque(1, 1, 0, at, ray);
    else if (mapped && fresh) add_opaque(1, 0, 1, at, ray);
    else if (mapped) add_opaque(1, 0, 0, at, ray);
    else if (partial && fresh) add_opaque(0, 1, 1, at, ray);
    else if (partial) add_opaque(0, 1, 0, at, ray);
    else if (fresh) add_opaque(0, 0, 1, at, ray);
    else add_opaque(0, 0, 0, at, ray);
#else
    if (mapped && partial) add_slab(1, 1, at, ray);
    else if (mapped) add_slab(1, 0, at, ray);
    else if (partial) add_slab(0, 1, at, ray);
    else add_slab(0, 0, at, ray);
#endif
}

#endif
