// Kernels by distance where surfaces occlude each other: each photosite gathers light in its own colour, with the kernels of the surface
// that it comes from; nearer slabs of blur radius occlude farther ones,
//   light(x) = tail(x) + sum over slabs s of open_s(x) * light_s(x) / sum over s of open_s(x) * seen_s(x)
// where light_s is the sum over taps t of kernel_s(t) * share_s(p(x + t)) * planes(x + t), and seen_s the same of coverage over the sum of
// a kernel. open_s is what slabs nearer by a given difference in radius, and nearer layers, let through.
// Shares interpolate kernels over p, the place between the slabs. A kernel is mixed from those of the nodes around the photosite.
//
// planes, slab_place, tail, light: as in kernels/psf_own_slabs.cl. tiles, terms, kernels, limits, halves, pairs: kernels/psf_slabs.h.
// OPAQUE 0: light is not divided by what is seen. HISTORY: most slabs of which none occludes another. NODE_SPAN: most node columns of a slab.
#include "conventions.h"
#include "interleaved_columns.h"
#include "psf_slab_sum.h"
#include "psf_slabs.h"
#include "psf_tail.h"
#include "row_band.h"

// Dimension 0: spans of a tile; 1: its rows of photosites, each as even and odd columns; 2: tiles.
kernel void psf_slabs(global const float *restrict planes, global const float *restrict slab_place, global const float *restrict tail,
                      global float *restrict light, global const struct slab_tile *restrict tiles, global const struct slab_term *restrict terms,
                      global const float *restrict kernels, global const float *restrict limits, const uint halves, const uint pairs,
                      const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct slab_tile tile = tiles[get_global_id(2)];
    const uint row = tile.row + (uint)(get_global_id(1) >> 1), y = (uint)band.frame_y + row; // y wraps above the frame
    const size_t column = tile.column + get_global_id(0) * SPAN;
    if (y >= band.height) return;
    const size_t colour = band_color((uint)parity, row, band), channels = band.channels, size = TAPS * TAPS, line = pairs * channels * size;
    const float limit = limits[colour], whole = limits[channels + colour], place = limits[2 * channels + row];
    const size_t node = (size_t)place, sets = 2 * (channels + COVERAGE);
    const float share = place - (float)node;
    const size_t below = share > 0.0f ? line : 0;
    global const float *across = limits + 2 * channels + rows + 2 * column + parity;
    float total[SPAN], seen[SPAN], layer_seen[SPAN], open[SPAN], passed[HISTORY * SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = seen[i] = layer_seen[i] = 0.0f, open[i] = passed[i] = 1.0f;
    uint slab = 0; // of the layer
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n += terms[n].columns) {
        const struct slab_term term = terms[n];
        global const float *from = planes + row_start(sets * term.layer + 2 * colour, row, rows, columns) + column;
        global const float *cover = planes + row_start(sets * term.layer + 2 * channels, row, rows, columns) + column;
        float sum[NODE_SPAN * SPAN], sum_seen[NODE_SPAN * SPAN];
        for (uint i = 0; i < NODE_SPAN * SPAN; i++) sum[i] = sum_seen[i] = 0.0f;
        sum_slab(from, cover, slab_place + row_start(2 * term.layer, row, rows, columns) + column,
                 kernels + node * line + (term.pair * channels + colour) * size, term, rows * columns, columns, parity, channels * size, below,
                 halves, share, limit, sum, sum_seen);
        for (uint i = 0; i < SPAN; i++) {
            float own_light = 0.0f, own_seen = 0.0f;
            for (uint c = 0; c < term.columns; c++) {
                const float of_node = across[(term.node_column + c) * 2 * columns + 2 * i];
                own_light += of_node * sum[c * SPAN + i];
                own_seen += of_node * sum_seen[c * SPAN + i];
            }
            const float before = passed[term.front % HISTORY * SPAN + i], covered = before * own_seen / whole;
            const float left = passed[slab % HISTORY * SPAN + i] - covered;
            total[i] += open[i] * before * own_light;
            seen[i] += open[i] * covered;
            layer_seen[i] += covered;
            passed[(slab + 1) % HISTORY * SPAN + i] = left > 0.0f ? left : 0.0f;
        }
        slab = term.ends ? 0 : slab + 1;
        for (uint i = 0; term.ends && i < SPAN; i++) {
            const float rest = open[i] * (1.0f - layer_seen[i]);
            open[i] = rest > 0.0f ? rest : 0.0f, layer_seen[i] = 0.0f, passed[i] = 1.0f;
        }
    }
    for (uint i = 0; i < SPAN; i++) total[i] = OPAQUE && seen[i] > 0.001f ? total[i] / seen[i] : total[i];
    add_tail(tail + colour * (2 * columns / CELL) * (rows / CELL), 2 * columns / CELL, row, 2 * column + parity, total);
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
        if (x < band.width) light[(size_t)y * band.width + x] = total[i] > 0.0f ? total[i] : 0.0f;
    }
}
