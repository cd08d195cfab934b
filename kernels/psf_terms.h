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

// Weight of a term at photosite i of a span: of its column of nodes, times that for the blur radius own[i]. across: at the first photosite.
INLINE float term_weight(const struct term term, global const float *across, const size_t columns, global const float *own, const uint i) {
    const float away = MAPPED ? own[i] - term.radius : 0.0f, weight = 1.0f - (away < 0.0f ? -away * term.rise : away * term.fall);
    return weight > 0.0f ? across[term.node_column * 2 * columns + 2 * i] * weight : 0.0f;
}

#endif
