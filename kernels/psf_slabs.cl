// Kernels by distance where surfaces occlude each other: each photosite gathers light in its own colour, with the kernels of the surface
// that it comes from; nearer slabs of blur radius occlude farther ones,
//   light(x) = tail(x) + sum over slabs s of open_s(x) * light_s(x) / sum over s of open_s(x) * seen_s(x)
// where light_s is the sum over taps t of kernel_s(t) * share_s(R(x + t)) * planes(x + t), and seen_s the same of coverage over the sum of
// a kernel. open_s is what slabs nearer by a given difference in radius, and nearer layers, let through.
// share_s falls from 1 at the slab's radius to 0 at its neighbours'. A kernel is mixed from those of the nodes around the photosite.
//
// planes, radius, tail, light: as in kernels/psf_own_slabs.cl. tiles, terms, kernels, limits, halves, pairs: kernels/psf_slabs.h.
// OPAQUE 0: light is not divided by what is seen. HISTORY: most slabs of which none occludes another. NODE_SPAN: most node columns of a slab.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "psf_slabs.h"
#include "psf_tail.h"
#include "row_band.h"

#define FIRST ((-TAPS / 2 - 1) / 2) // column within its set of the leftmost tap, or the one before it
#define WIDE (SPAN + TAPS / 2 + 4)   // columns of a set that the taps of a span read

// Sums of light and of coverage over the taps of one slab and of its columns of nodes: (NODE_SPAN, SPAN). from, cover, far: colour, coverage and
// blur radius at the span's first column of even photosites. set_step: elements to that of odd ones.
INLINE void sum_slab(global const float *from, global const float *cover, global const float *far,
                     global const float *of_slab, const struct slab_term term, const size_t set_step, const size_t columns,
                     const size_t parity, const size_t pair_step, const size_t below, const size_t halves, const float share,
                     const float limit, float *sum, float *seen) {
    for (int j = 0; j < TAPS; j++) {
        float lit[2 * WIDE], held[2 * WIDE], above[2 * WIDE], all = 0.0f;
        for (uint set = 0; set < 2; set++) {
            const long start = (long)(set * set_step) + (j - TAPS / 2) * (long)columns + FIRST;
            for (uint k = 0; k < WIDE; k++) {
                const float own = slab_share(term, far[start + k]), value = from[start + k], dim = BRIGHT && value > limit ? limit : value;
                lit[set * WIDE + k] = own * dim;
                above[set * WIDE + k] = BRIGHT ? own * (value - dim) : 0.0f;
                all += held[set * WIDE + k] = COVERAGE ? own * cover[start + k] : own;
            }
        }
        if (all == 0.0f) continue; // no photosite of the row is of this slab
        for (uint c = 0; c < term.columns; c++) {
            float weight[TAPS], excess[TAPS];
            mix_taps(of_slab + c * pair_step + j * TAPS, below, halves, share, weight, excess);
            for (uint i = 0; i < SPAN; i++) {
                float part = 0.0f, covered = 0.0f;
                __attribute__((opencl_unroll_hint(TAPS)))
                for (uint t = 0; t < TAPS; t++) {
                    const int sample = (int)(parity + t) - TAPS / 2, at = column_set(sample) * WIDE + column_in_set(sample) - FIRST;
                    part += BRIGHT ? weight[t] * lit[at + i] + excess[t] * above[at + i] : weight[t] * lit[at + i];
                    covered += weight[t] * held[at + i];
                }
                sum[c * SPAN + i] += part;
                seen[c * SPAN + i] += covered;
            }
        }
    }
}

// Dimension 0: spans of a tile; 1: its rows of photosites, each as even and odd columns; 2: tiles.
kernel void psf_slabs(global const float *restrict planes, global const float *restrict radius, global const float *restrict tail,
                      global float *restrict light, global const struct slab_tile *restrict tiles, global const struct slab_term *restrict terms,
                      global const float *restrict kernels, global const float *restrict limits, const uint halves, const uint pairs,
                      const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct slab_tile tile = tiles[get_global_id(2)];
    const uint row = tile.row + (uint)(get_global_id(1) >> 1), y = (uint)band.frame_y + row; // y wraps above the frame
    const size_t column = tile.column + get_global_id(0) * SPAN;
    if (y >= band.height) return;
    const size_t colour = cfa_plane(parity, row), size = TAPS * TAPS, line = pairs * CHANNELS * size;
    const float limit = limits[colour], whole = limits[CHANNELS + colour], place = limits[2 * CHANNELS + row];
    const size_t node = (size_t)place, sets = 2 * (CHANNELS + COVERAGE);
    const float share = place - (float)node;
    const size_t below = share > 0.0f ? line : 0;
    global const float *across = limits + 2 * CHANNELS + rows + 2 * column + parity;
    float total[SPAN], seen[SPAN], layer_seen[SPAN], open[SPAN], passed[HISTORY * SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = seen[i] = layer_seen[i] = 0.0f, open[i] = passed[i] = 1.0f;
    uint slab = 0; // of the layer
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n += terms[n].columns) {
        const struct slab_term term = terms[n];
        global const float *from = planes + row_start(sets * term.layer + 2 * colour, row, rows, columns) + column;
        global const float *cover = planes + row_start(sets * term.layer + 2 * CHANNELS, row, rows, columns) + column;
        float sum[NODE_SPAN * SPAN], sum_seen[NODE_SPAN * SPAN];
        for (uint i = 0; i < NODE_SPAN * SPAN; i++) sum[i] = sum_seen[i] = 0.0f;
        sum_slab(from, cover, radius + row_start(2 * term.layer, row, rows, columns) + column,
                 kernels + node * line + (term.pair * CHANNELS + colour) * size, term, rows * columns, columns, parity, CHANNELS * size, below,
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
