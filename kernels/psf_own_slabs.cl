// Kernels by distance where a photosite sees one surface whose blur radius R hardly changes: it gathers light in its own colour with the
// kernels of its own radius,
//   light(x) = tail(x) + sum over slabs s of share_s(p(x)) * sum over taps t of kernel_s(t) * planes(x + t)
// Shares interpolate kernels over p, the place between the slabs. A kernel is mixed from those of the nodes around the photosite.
//
// planes:  (LAYERS, CHANNELS + COVERAGE, 2, rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1] times coverage, then with
//          COVERAGE 1 coverage; interleaved columns, one sample per photosite, a band with its margins. Its first photosite has
//          even coordinates on the sensor, whose filter cfa.h holds.
// slab_place: (LAYERS, 2, rows, set_columns) float32, number of a slab and part of the way to the next (kernels/psf_slab_bits.cl).
// tail:    (CHANNELS, rows / CELL, 2 set_columns / CELL) float32, light of the tail at the cells' centres (kernels/psf_tail.cl).
// light:   (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1], written. tiles, terms, kernels, limits, halves, pairs: psf_slabs.h.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "psf_slabs.h"
#include "psf_tail.h"
#include "row_band.h"

// Dimension 0: spans of a tile; 1: its rows of photosites, each as even and odd columns; 2: tiles.
kernel void psf_own_slabs(global const float *restrict planes, global const float *restrict slab_place, global const float *restrict tail,
                          global float *restrict light, global const struct slab_tile *restrict tiles,
                          global const struct slab_term *restrict terms, global const float *restrict kernels,
                          global const float *restrict limits, const uint halves, const uint pairs, const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct slab_tile tile = tiles[get_global_id(2)];
    const uint row = tile.row + (uint)(get_global_id(1) >> 1), y = (uint)band.frame_y + row; // y wraps above the frame
    const size_t column = tile.column + get_global_id(0) * SPAN;
    if (y >= band.height) return;
    const size_t colour = cfa_plane(parity, row), size = TAPS * TAPS, line = pairs * CHANNELS * size;
    const float limit = limits[colour], place = limits[2 * CHANNELS + row];
    const size_t node = (size_t)place;
    const float share = place - (float)node;
    const size_t below = share > 0.0f ? line : 0;
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n++) {
        const struct slab_term term = terms[n];
        global const float *of_term = kernels + node * line + (term.pair * CHANNELS + colour) * size;
        global const float *column_weight = limits + 2 * CHANNELS + rows + 2 * column + parity + term.node_column * 2 * columns;
        global const float *own = slab_place + row_start(2 * term.layer + parity, row, rows, columns) + column;
        float sum[SPAN], all = 0.0f;
        for (uint i = 0; i < SPAN; i++) sum[i] = 0.0f;
        for (uint i = 0; i < SPAN; i++) {
            const float here = column_weight[2 * i] * slab_share(term, own[i]);
            all += here * here;
        }
        if (all == 0.0f) continue; // no photosite of the span has this term
        global const float *from = planes + row_start(2 * (term.layer * (CHANNELS + COVERAGE) + colour), row, rows, columns) + column;
        for (int j = 0; j < TAPS; j++) {
            float weight[TAPS], excess[TAPS];
            mix_taps(of_term + j * TAPS, below, halves, share, weight, excess);
            float high = 0.0f; // light of the row above the limit
            for (uint set = 0; BRIGHT && set < 2; set++) {
                const long start = ((long)(set * rows) + j - TAPS / 2) * (long)columns + FIRST;
                for (uint k = 0; k < WIDE; k++) high += from[start + k] > limit ? from[start + k] - limit : 0.0f;
            }
            if (!BRIGHT || high == 0.0f) {
                for (uint i = 0; i < SPAN; i++) {
                    float part = 0.0f;
                    __attribute__((opencl_unroll_hint(TAPS)))
                    for (uint t = 0; t < TAPS; t++) {
                        const int sample = (int)(parity + t) - TAPS / 2;
                        part += weight[t] * from[(column_set(sample) * (long)rows + j - TAPS / 2) * (long)columns + column_in_set(sample) + i];
                    }
                    sum[i] += part;
                }
                continue;
            }
            for (uint i = 0; i < SPAN; i++) {
                float part = 0.0f;
                __attribute__((opencl_unroll_hint(TAPS)))
                for (uint t = 0; t < TAPS; t++) {
                    const int sample = (int)(parity + t) - TAPS / 2;
                    const float value = from[(column_set(sample) * (long)rows + j - TAPS / 2) * (long)columns + column_in_set(sample) + i];
                    const float dim = value > limit ? limit : value;
                    part += weight[t] * dim + excess[t] * (value - dim);
                }
                sum[i] += part;
            }
        }
        for (uint i = 0; i < SPAN; i++) total[i] += column_weight[2 * i] * slab_share(term, own[i]) * sum[i];
    }
    add_tail(tail + colour * (2 * columns / CELL) * (rows / CELL), 2 * columns / CELL, row, 2 * column + parity, total);
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
        if (x < band.width) light[(size_t)y * band.width + x] = total[i] > 0.0f ? total[i] : 0.0f;
    }
}
