// Which kernels the photosites of a tile gather with (kernels/psf_gather.cl), and the weight of each at a photosite.
#ifndef PSF_TERMS_H
#define PSF_TERMS_H
#include "conventions.h"

struct tile {
    uint column, row;       // first photosite in the band: column within its set, row of photosites
    uint first_term, terms; // in `terms`
};

struct term {
    uint number, node_column;  // kernel: number of its blur radius, column of nodes
    float radius, rise, fall;  // weight: 1 at this radius, less by `rise` and by `fall` for each photosite of radius below and above it
};

// Weights of a term at the SPAN photosites of a span: of its column of nodes, times that for the blur radius own[i]. across: at the first
// photosite. Returns whether any is not 0.
INLINE uint term_weights(const struct term term, global const float *across, const size_t columns, global const float *own, float *weights) {
    uint any = 0;
    for (uint i = 0; i < SPAN; i++) {
        const float away = MAPPED ? own[i] - term.radius : 0.0f, weight = 1.0f - (away < 0.0f ? -away * term.rise : away * term.fall);
        const float of_node = NODE_COLUMNS > 1 ? across[term.node_column * 2 * columns + 2 * i] : 1.0f;
        weights[i] = weight > 0.0f ? of_node * weight : 0.0f;
        any |= weights[i] > 0.0f;
    }
    return any;
}

#endif
