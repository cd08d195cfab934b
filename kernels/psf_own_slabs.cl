// Kernels by distance where a photosite sees one surface whose blur radius R hardly changes: it gathers light in its own colour with the
// kernels of its own radius,
//   light(x) = tail(x) + sum over slabs s of share_s(p(x)) * sum over taps t of kernel_s(t) * planes(x + t)
// Shares interpolate kernels over p, the place between the slabs. A kernel is mixed from those of the nodes around the photosite.
//
// planes:  (LAYERS, channels + COVERAGE, 2, rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1] times coverage, then with
//          COVERAGE 1 coverage; interleaved columns, one sample per photosite, a band with its margins. Its first photosite has
//          even coordinates on the sensor.
// slab_place: (LAYERS, 2, rows, set_columns) float32, number of a slab and part of the way to the next (kernels/psf_slab_bits.cl).
// tail:    (channels, rows / CELL, 2 set_columns / CELL) float32, light of the tail at the cells' centres (kernels/psf_tail.cl).
// light:   (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1], written. tiles, terms, kernels, limits, halves, pairs: psf_slabs.h.
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
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
    const size_t colour = band_color((uint)parity, row, band), channels = band.channels, size = TAPS * TAPS, line = pairs * channels * size;
    const float limit = limits[colour], place = limits[2 * channels + row];
    const size_t node = (size_t)place;
    const float share = place - (float)node;
    const size_t below = share > 0.0f ? line : 0;
    const int leftmost = (int)parity - TAPS / 2; // of the taps, from the span's first even photosite
    const long first_set = column_set(leftmost) * (long)(rows * columns) + column_in_set(leftmost);
    const long second_set = column_set(leftmost + 1) * (long)(rows * columns) + column_in_set(leftmost + 1);
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n += terms[n].columns) {
        const struct slab_term term = terms[n];
        global const float *own = slab_place + row_start(2 * term.layer + parity, row, rows, columns) + column;
        global const float *from = planes + row_start(2 * (term.layer * (channels + COVERAGE) + colour), row, rows, columns) + column;
        float of_slab[SPAN];
        uint any = 0;
        for (uint i = 0; i < SPAN; i++) {
            of_slab[i] = slab_share(term, own[i]);
            any |= of_slab[i] != 0.0f;
        }
        for (uint c = 0; any && c < term.columns; c++) { // else no photosite of the span has this slab
            global const float *of_term = kernels + node * line + ((term.pair + c) * channels + colour) * size;
            global const float *column_weight = limits + 2 * channels + rows + 2 * column + parity + (term.node_column + c) * 2 * columns;
            float sum[SPAN], weight[TAPS * TAPS], excess[BRIGHT ? TAPS * TAPS : 1];
            mix_taps(TAPS * TAPS, of_term, below, halves, share, weight, excess);
            for (uint i = 0; i < SPAN; i++) sum[i] = 0.0f;
            for (int j = 0; j < TAPS; j++) {
                global const float *even = from + first_set + (j - TAPS / 2) * (long)columns, *odd = from + second_set + (j - TAPS / 2) * (long)columns;
                LANES
                for (uint i = 0; i < SPAN; i++) {
                    float part = 0.0f;
                    __attribute__((opencl_unroll_hint(TAPS)))
                    for (uint t = 0; t < TAPS; t++) {
                        const float value = t % 2 ? odd[t / 2 + i] : even[t / 2 + i], dim = BRIGHT && value > limit ? limit : value;
                        part += BRIGHT ? weight[j * TAPS + t] * dim + excess[j * TAPS + t] * (value - dim) : weight[j * TAPS + t] * value;
                    }
                    sum[i] += part;
                }
            }
            for (uint i = 0; i < SPAN; i++) total[i] += column_weight[2 * i] * of_slab[i] * sum[i];
        }
    }
    add_tail(tail + colour * (2 * columns / CELL) * (rows / CELL), 2 * columns / CELL, row, 2 * column + parity, total);
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
        if (x < band.width) light[(size_t)y * band.width + x] = total[i] > 0.0f ? total[i] : 0.0f;
    }
}
