// Kernels by distance where surfaces occlude each other: each photosite gathers light in its own colour, with the kernels of the surface
// that it comes from; nearer slabs of blur radius occlude farther ones,
//   light(x) = tail(x) + sum over slabs s of open_s(x) * light_s(x) / sum over s of open_s(x) * seen_s(x)
// where light_s is the sum over taps t of kernel_s(t) * share_s(p(x + t)) * planes(x + t), and seen_s the same of coverage over the sum of
// a kernel. open_s is what slabs nearer by a given difference in radius, and nearer layers, let through.
// Shares interpolate kernels over p, the place between the slabs. A kernel is mixed from those of the nodes around the photosite.
//
// planes, slab_place, tail, light: as in kernels/psf_own_slabs.cl. tiles, terms, kernels, limits, line, halves: kernels/psf_slabs.h.
// OPAQUE 0: light is not divided by what is seen. HISTORY: most slabs of which none occludes another. NODE_SPAN: most node columns of a slab.
// ROWS: rows of photosites of one colour that a work-item computes, which read the same light.
#include "conventions.h"
#include "interleaved_columns.h"
#include "psf_slab_sum.h"
#include "psf_slabs.h"
#include "psf_tail.h"
#include "row_band.h"

// Dimension 0: spans of a tile; 1: groups of its rows of photosites, each as even and odd rows and columns; 2: tiles.
kernel void psf_slabs(global const float *restrict planes, global const float *restrict slab_place, global const float *restrict tail,
                      global float *restrict light, global const struct slab_tile *restrict tiles, global const struct slab_term *restrict terms,
                      global const float *restrict kernels, global const float *restrict limits, const uint halves, const uint line,
                      const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct slab_tile tile = tiles[get_global_id(2)];
    const uint first_row = tile.row + (uint)(get_global_id(1) >> 2) * 2 * ROWS + (uint)(get_global_id(1) >> 1 & 1);
    const size_t column = tile.column + get_global_id(0) * SPAN;
    const size_t colour = band_color((uint)parity, first_row, band), channels = band.channels, sets = 2 * (channels + COVERAGE);
    const float limit = limits[colour], whole = limits[channels + colour];
    global const float *across = limits + 2 * channels + rows + 2 * column + parity;
    float total[ROWS * SPAN], seen[ROWS * SPAN], layer_seen[ROWS * SPAN], open[ROWS * SPAN], passed[HISTORY * ROWS * SPAN];
    for (uint i = 0; i < ROWS * SPAN; i++) total[i] = seen[i] = layer_seen[i] = 0.0f, open[i] = passed[i] = 1.0f;
    uint slab = 0; // of the layer
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n += terms[n].columns) {
        const struct slab_term term = terms[n];
        size_t reach = 0;
        for (uint c = 0; c < term.columns; c++) reach = terms[n + c].reach > reach ? terms[n + c].reach : reach;
        const long leftmost = first_column(parity, (long)reach); // of the columns of samples, from the span's first
        const size_t top = first_row - reach, taps = row_taps(reach), skip = first_tap(parity, (long)reach), count = SPAN + taps / 2;
        float sum[NODE_SPAN * ROWS * SPAN], sum_seen[NODE_SPAN * ROWS * SPAN];
        for (uint i = 0; i < NODE_SPAN * ROWS * SPAN; i++) sum[i] = sum_seen[i] = 0.0f;
        for (size_t row = top; row <= first_row + 2 * (ROWS - 1) + reach; row++) {
            struct slab_row own;
            read_row(planes + row_start(sets * term.layer + 2 * colour, row, rows, columns) + column + leftmost,
                     planes + row_start(sets * term.layer + 2 * channels, row, rows, columns) + column + leftmost,
                     slab_place + row_start(2 * term.layer, row, rows, columns) + column + leftmost, term, rows * columns, count, limit, &own);
            if (!own.any) continue; // no photosite of the row is of this slab
            for (uint r = 0; r < ROWS; r++) {
                const long j = (long)row - (long)(first_row + 2 * r);
                if (j > (long)reach || -j > (long)reach) continue;
                const float place = limits[2 * channels + first_row + 2 * r];
                const size_t node = (size_t)place, below = place > (float)node ? line : 0;
                float weight[NODE_SPAN * ROOM], excess[BRIGHT ? NODE_SPAN * ROOM : 1];
                for (uint c = 0; c < NODE_SPAN; c++)
                    mix_row(kernels + node * line, terms[c < term.columns ? n + c : n], c < term.columns, colour, j, reach, below, halves,
                            place - (float)node, weight + c * ROOM, excess + (BRIGHT ? c * ROOM : 0));
                add_taps(weight + skip, own.lit, own.held, taps, sum + r * SPAN, sum_seen + r * SPAN);
                if (BRIGHT && own.high) add_light(excess + skip, own.above, taps, sum + r * SPAN);
            }
        }
        for (uint i = 0; i < ROWS * SPAN; i++) {
            float own_light = 0.0f, own_seen = 0.0f;
            for (uint c = 0; c < term.columns; c++) {
                const float of_node = across[(term.node_column + c) * 2 * columns + 2 * (i % SPAN)];
                own_light += of_node * sum[c * ROWS * SPAN + i];
                own_seen += of_node * sum_seen[c * ROWS * SPAN + i];
            }
            const float before = passed[term.front % HISTORY * ROWS * SPAN + i], covered = before * own_seen / whole;
            const float left = passed[slab % HISTORY * ROWS * SPAN + i] - covered;
            total[i] += open[i] * before * own_light;
            seen[i] += open[i] * covered;
            layer_seen[i] += covered;
            passed[(slab + 1) % HISTORY * ROWS * SPAN + i] = left > 0.0f ? left : 0.0f;
        }
        slab = term.ends ? 0 : slab + 1;
        for (uint i = 0; term.ends && i < ROWS * SPAN; i++) {
            const float rest = open[i] * (1.0f - layer_seen[i]);
            open[i] = rest > 0.0f ? rest : 0.0f, layer_seen[i] = 0.0f, passed[i] = 1.0f;
        }
    }
    for (uint r = 0; r < ROWS; r++) {
        const uint row = first_row + 2 * r, y = (uint)band.frame_y + row; // y wraps above the frame
        float *of_row = total + r * SPAN;
        if (y >= band.height) continue;
        for (uint i = 0; i < SPAN; i++) of_row[i] = OPAQUE && seen[r * SPAN + i] > 0.001f ? of_row[i] / seen[r * SPAN + i] : of_row[i];
        add_tail(tail + colour * (2 * columns / CELL) * (rows / CELL), 2 * columns / CELL, row, 2 * column + parity, of_row);
        for (uint i = 0; i < SPAN; i++) {
            const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
            if (x < band.width) light[(size_t)y * band.width + x] = of_row[i] > 0.0f ? of_row[i] : 0.0f;
        }
    }
}
