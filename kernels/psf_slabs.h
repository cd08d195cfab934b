// What kernels by distance have in common (kernels/psf_own_slabs.cl and kernels/psf_slabs.cl): their tables.
//
// tiles:   (tiles) struct slab_tile. terms: (terms) struct slab_term, of all tiles: by layer, by slab from near to far, by column of nodes.
// kernels: (1 + BRIGHT, node rows, line) float32; the second half is for light above `limits`. A line holds the kernels of all slabs and
//          columns of nodes, (channels, 2 reach + 1, whole chunks of CHUNK) each: a 0, the taps of a row from left to right, and zeros.
// line, halves: elements of a line and of a half.
// limits:  (channels) float32 [e- s^-1 um^-2 sr^-1], (channels) sum of a kernel, (rows) place of each row of photosites between the
//          node rows, (node columns, 2 set_columns) weight of each column of nodes at each column of photosites.
// The host defines REACH, the farthest of the kernels [photosites], and CHUNK, taps that are gathered at a time.
#ifndef PSF_SLABS_H
#define PSF_SLABS_H
#include "conventions.h"

#define MOST_TAPS ((2 * REACH + 1 + CHUNK) / CHUNK * CHUNK) // of a row of a kernel

#define ROOM (MOST_TAPS + CHUNK) // elements of a row of taps in the middle of a wider one

struct slab_tile {
    uint column, row;       // first photosite in the band: column within its set, row of photosites
    uint first_term, terms; // in `terms`
};

struct slab_term {
    uint core, reach;        // first element of the kernel in its line; taps to either side of its middle
    uint node_column, layer; // column of nodes that the kernel is of; layer of the scene that its light is from
    uint front;              // number of the layer's slabs before this one that occlude it
    uint columns;            // terms of this slab from here on
    uint ends;               // 1: the last slab of its layer
    float number;            // of the slab
};

// Columns of a row of a kernel of this reach.
INLINE size_t row_taps(const size_t reach) { return (2 * reach + 1 + CHUNK) / CHUNK * CHUNK; }

// First tap of a row of a kernel that a photosite of this parity gathers: the 0 before the others, or the next, where an even sample is.
INLINE size_t first_tap(const size_t parity, const long reach) { return ((long)parity - reach) & 1 ? 0 : 1; }

// Column within its set of the sample of that tap, from the photosite's.
INLINE long first_column(const size_t parity, const long reach) { return ((long)parity - reach) >> 1; }

// Share of a slab in light at a place between the slabs: cubic interpolation (Lagrange) through the four slabs around it.
INLINE float slab_share(const struct slab_term term, const float place) {
    const float beyond = place - term.number, away = beyond < 0.0f ? -beyond : beyond;
    const float near = 0.5f * (1.0f - away * away) * (2.0f - away), far = (1.0f - away) * (2.0f - away) * (3.0f - away) * (1.0f / 6.0f);
    return away < 1.0f ? near : away < 2.0f ? far : 0.0f;
}

// Weights of a row of taps of a term, j rows below the middle of its kernel, (ROOM) in the middle of a kernel of this reach: mixed from
// those of the node rows above and below, and 0 beyond its own reach, or where it is not used. kernels: of the node row above. below:
// elements to the row below; share: of its weight. excess: the same of the second half, with BRIGHT.
INLINE void mix_row(global const float *kernels, const struct slab_term term, const bool is_used, const size_t colour, const long j,
                    const size_t reach, const size_t below, const size_t halves, const float share, float *weight, float *excess) {
    const size_t row = (size_t)(j + (long)term.reach), count = row_taps(term.reach), spare = reach - term.reach; // row wraps above the kernel
    global const float *tap = kernels + term.core + (colour * (2 * term.reach + 1) + row) * count;
    const bool is_beyond = !is_used || row > 2 * term.reach;
    if (is_beyond || spare)
        for (size_t t = 0; t < ROOM; t++) weight[t] = excess[BRIGHT ? t : 0] = 0.0f;
    if (!is_beyond)
        for (size_t first = 0; first < count; first += CHUNK)
            for (size_t t = first; t < first + CHUNK; t++) {
                weight[spare + t] = tap[t] + share * (tap[below + t] - tap[t]);
                if (BRIGHT) excess[spare + t] = tap[halves + t] + share * (tap[halves + below + t] - tap[halves + t]);
            }
    if (!spare) weight[count] = excess[BRIGHT ? count : 0] = 0.0f;
}

#endif
