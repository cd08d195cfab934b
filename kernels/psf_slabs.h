// What kernels by distance have in common (kernels/psf_own_slabs.cl and kernels/psf_slabs.cl): their tables.
//
// tiles:   (tiles) struct slab_tile. terms: (terms) struct slab_term, of all tiles: by layer, by slab from near to far, by column of nodes.
// kernels: (1 + BRIGHT, node rows, pairs, channels, TAPS, TAPS) float32; pairs of slab and column of nodes. The second half is for light
//          above `limits`. halves, pairs: elements of a half, and number of pairs.
// limits:  (channels) float32 [e- s^-1 um^-2 sr^-1], (channels) sum of a kernel, (rows) place of each row of photosites between the
//          node rows, (node columns, 2 set_columns) weight of each column of nodes at each column of photosites.
#ifndef PSF_SLABS_H
#define PSF_SLABS_H
#include "conventions.h"

#define FIRST ((-TAPS / 2 - 1) / 2) // column within its set of the leftmost tap, or the one before it
#define VECTOR (SPAN >= 16 ? 16 : 1)
#define WIDE ((SPAN + TAPS / 2 + VECTOR) / VECTOR * VECTOR) // columns of a set that the taps of a span read, in whole vectors

struct slab_tile {
    uint column, row;       // first photosite in the band: column within its set, row of photosites
    uint first_term, terms; // in `terms`
};

struct slab_term {
    uint pair, node_column, layer; // kernel, column of nodes, layer
    uint front;                    // number of the layer's slabs before this one that occlude it
    uint columns;                  // terms of this slab from here on
    uint ends;                     // 1: the last slab of its layer
    float number;                  // of the slab
};

// Share of a slab in light at a place between the slabs: cubic interpolation (Lagrange) through the four slabs around it.
INLINE float slab_share(const struct slab_term term, const float place) {
    const float beyond = place - term.number, away = beyond < 0.0f ? -beyond : beyond;
    const float near = 0.5f * (1.0f - away * away) * (2.0f - away), far = (1.0f - away) * (2.0f - away) * (3.0f - away) * (1.0f / 6.0f);
    return away < 1.0f ? near : away < 2.0f ? far : 0.0f;
}

// Weights of `count` taps, mixed from the node rows above and below: `weight` for all light, or for light up to the limit, and `excess`
// for light above it. tap: of the node row above. below: elements to the same of the row below; share: of its weight.
INLINE void mix_taps(const uint count, global const float *tap, const size_t below, const size_t halves, const float share, float *weight,
                     float *excess) {
    for (uint t = 0; t < count; t++) {
        weight[t] = tap[t] + share * (tap[below + t] - tap[t]);
        if (BRIGHT) excess[t] = tap[halves + t] + share * (tap[halves + below + t] - tap[halves + t]);
    }
}

#endif
