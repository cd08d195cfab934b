// Parts of a mean over the aperture's image: what each node of the radius counts, and a node's sum from running sums.
#ifndef APERTURE_MEAN_H
#define APERTURE_MEAN_H
#include "conventions.h"

// What a node counts at a place [nodes]: Lagrange's cubic on the four nearest; linear below a radius of 1, where a circle that does
// not leave its photosite is none and a cubic would swing.
INLINE float share(const float place, const int node, const float nodes_per_px) {
    const float distance = place - (float)node, t = distance < 0.0f ? -distance : distance;
    const float outer = t < 2.0f ? (1.0f - t) * (2.0f - t) * (3.0f - t) * (1.0f / 6.0f) : 0.0f;
    const float cubic = t < 1.0f ? (1.0f - t * t) * (1.0f - 0.5f * t) : outer, linear = t < 1.0f ? 1.0f - t : 0.0f;
    return OVER == 1 && place > -nodes_per_px && place < nodes_per_px ? linear : cubic;
}

INLINE void add_taps(global const float *line, global const int *places, global const float *shares, const int count, float *mean) {
    for (int tap = 0; tap < count; tap += 8) {
        global const float *a = line + places[tap], *b = line + places[tap + 1], *c = line + places[tap + 2], *d = line + places[tap + 3];
        global const float *e = line + places[tap + 4], *f = line + places[tap + 5], *g = line + places[tap + 6], *h = line + places[tap + 7];
        const float wa = shares[tap], wb = shares[tap + 1], wc = shares[tap + 2], wd = shares[tap + 3];
        const float we = shares[tap + 4], wf = shares[tap + 5], wg = shares[tap + 6], wh = shares[tap + 7];
        for (uint i = 0; i < SPAN; i++)
            mean[i] = mean[i] + (wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i]) + (we * e[i] + wf * f[i] + wg * g[i] + wh * h[i]);
    }
}

#endif
