// Mean over the image of the aperture: its taps, and the interpolation between tabulated blur radii.
#ifndef APERTURE_MEAN_H
#define APERTURE_MEAN_H
#include "conventions.h"
#include "lanes.h"

// One read of a plane and its weight in a sum.
struct tap {
    int offset[2]; // elements from the photosite's own column to what is read, for a photosite in an even and in an odd column
    float weight;  // factor of the value read; of running sums, of its difference from the one read before
};

// The image of the aperture at one tabulated blur radius.
struct node {
    int first_tap, taps;   // taps that read running sums, or samples where `direct`; counts are multiples of 8
    int radius;            // signed radius [1 / NODES_PER_PX photosites]
    int direct;            // 1: the taps read the samples themselves
};

// Weight of the table's node at `node` in the interpolation at `place` [both in steps of 1 / NODES_PER_PX photosites of radius]:
// Lagrange's cubic through the four nearest nodes. Within LINEAR_NODES of the focus it is linear, because the mean has a kink
// there and a cubic would overshoot: one photosite where OVER is 1, or half of one between close nodes, since a blur circle that
// stays within its photosite does not blur; one node where samples are even squares, since the light that crosses their borders grows with the radius.
INLINE float node_weight(const float place, const int node) {
    const float distance = place - (float)node, t = distance < 0.0f ? -distance : distance;
    const float outer = t < 2.0f ? (1.0f - t) * (2.0f - t) * (3.0f - t) * (1.0f / 6.0f) : 0.0f;
    const float cubic = t < 1.0f ? (1.0f - t * t) * (1.0f - 0.5f * t) : outer, linear = t < 1.0f ? 1.0f - t : 0.0f;
    return place > -LINEAR_NODES && place < LINEAR_NODES ? linear : cubic;
}

// Add the weighted reads of `count` taps, a multiple of 8, to mean[SPAN]. line: the plane at the first photosite's own column.
// parity: of the photosites' column. Eight taps are written out because a loop over taps inside the vectorised loop is slow.
INLINE void add_taps(global const float *line, global const struct tap *taps, const int count, const size_t parity, float *mean) {
    for (int first = 0; first < count; first += 8) {
        global const struct tap *t = taps + first;
        global const float *a = line + t[0].offset[parity], *b = line + t[1].offset[parity], *c = line + t[2].offset[parity];
        global const float *d = line + t[3].offset[parity], *e = line + t[4].offset[parity], *f = line + t[5].offset[parity];
        global const float *g = line + t[6].offset[parity], *h = line + t[7].offset[parity];
        const float wa = t[0].weight, wb = t[1].weight, wc = t[2].weight, wd = t[3].weight;
        const float we = t[4].weight, wf = t[5].weight, wg = t[6].weight, wh = t[7].weight;
        LANES
        for (uint i = 0; i < SPAN; i++)
            mean[i] = mean[i] + (wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i]) + (we * e[i] + wf * f[i] + wg * g[i] + wh * h[i]);
    }
}

// The same of running sums: each tap's weight is that of what was added since the tap before, the first of eight has none.
INLINE void add_differences(global const float *line, global const struct tap *taps, const int count, const size_t parity, float *mean) {
    for (int first = 0; first < count; first += 8) {
        global const struct tap *t = taps + first;
        global const float *a = line + t[0].offset[parity], *b = line + t[1].offset[parity], *c = line + t[2].offset[parity];
        global const float *d = line + t[3].offset[parity], *e = line + t[4].offset[parity], *f = line + t[5].offset[parity];
        global const float *g = line + t[6].offset[parity], *h = line + t[7].offset[parity];
        const float wb = t[1].weight, wc = t[2].weight, wd = t[3].weight;
        const float we = t[4].weight, wf = t[5].weight, wg = t[6].weight, wh = t[7].weight;
        LANES
        for (uint i = 0; i < SPAN; i++)
            mean[i] = mean[i] + (wb * (b[i] - a[i]) + wc * (c[i] - b[i]) + wd * (d[i] - c[i])) +
                (we * (e[i] - d[i]) + wf * (f[i] - e[i]) + wg * (g[i] - f[i]) + wh * (h[i] - g[i]));
    }
}

// Add the reads of an image of the aperture: of samples, or of their running sums.
INLINE void add_image(const struct node node, global const float *values, global const float *summed, global const struct tap *taps,
                      const size_t parity, float *mean) {
    if (node.direct) add_taps(values, taps + node.first_tap, node.taps, parity, mean);
    else add_differences(summed, taps + node.first_tap, node.taps, parity, mean);
}

// Add a value to a running sum, and to it what its rounding lost of the values before (Kahan). lost: by which the sum is too large.
INLINE void add_kept(const float value, float *running, float *lost) {
    const float added = value - *lost, next = *running + added;
    *lost = (next - *running) - added;
    *running = next;
}

#endif
