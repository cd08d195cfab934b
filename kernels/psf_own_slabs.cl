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
// light:   (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1], written. tiles, terms, kernels, limits, line, halves: psf_slabs.h.
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "psf_slabs.h"
#include "psf_tail.h"
#include "row_band.h"

#define TOGETHER 4 // terms that read the same light

// Dimension 0: spans of a tile; 1: its rows of photosites, each as even and odd columns; 2: tiles.
kernel void psf_own_slabs(global const float *restrict planes, global const float *restrict slab_place, global const float *restrict tail,
                          global float *restrict light, global const struct slab_tile *restrict tiles,
                          global const struct slab_term *restrict terms, global const float *restrict kernels,
                          global const float *restrict limits, const uint halves, const uint line, const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct slab_tile tile = tiles[get_global_id(2)];
    const uint row = tile.row + (uint)(get_global_id(1) >> 1), y = (uint)band.frame_y + row; // y wraps above the frame
    const size_t column = tile.column + get_global_id(0) * SPAN;
    if (y >= band.height) return;
    const size_t colour = band_color((uint)parity, row, band), channels = band.channels;
    const float limit = limits[colour], place = limits[2 * channels + row];
    const size_t node = (size_t)place;
    const float share = place - (float)node;
    const size_t below = share > 0.0f ? line : 0;
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    const uint last = tile.first_term + tile.terms - 1;
    for (uint n = tile.first_term; n <= last; n += TOGETHER) {
        float of_term[TOGETHER * SPAN], sum[TOGETHER * SPAN], weight[TOGETHER * ROOM], excess[BRIGHT ? TOGETHER * ROOM : 1];
        long reaches[TOGETHER], reach = -1; // -1: no photosite of the span has this term
        for (uint c = 0; c < TOGETHER; c++) {
            const struct slab_term term = terms[c <= last - n ? n + c : last];
            global const float *place = slab_place + row_start(2 * term.layer + parity, row, rows, columns) + column;
            global const float *across = limits + 2 * channels + rows + term.node_column * 2 * columns + 2 * column + parity;
            uint any = 0;
            for (uint i = 0; i < SPAN; i++) {
                of_term[c * SPAN + i] = c > last - n ? 0.0f : across[2 * i] * slab_share(term, place[i]);
                any |= of_term[c * SPAN + i] != 0.0f;
            }
            reaches[c] = any ? (long)term.reach : -1;
            reach = reaches[c] > reach ? reaches[c] : reach;
        }
        if (reach < 0) continue;
        for (uint k = 0; k < TOGETHER * SPAN; k++) sum[k] = 0.0f;
        const size_t taps = row_taps((size_t)reach), skip = first_tap(parity, reach);
        const size_t plane = 2 * (terms[n].layer * (channels + COVERAGE) + colour);
        global const float *even = planes + row_start(plane, row, rows, columns) + column + first_column(parity, reach) - reach * (long)columns;
        for (long j = -reach; j <= reach; j++, even += columns) {
            for (uint c = 0; c < TOGETHER; c++)
                mix_row(kernels + node * line, terms[c <= last - n ? n + c : last], reaches[c] >= 0, colour, j, (size_t)reach, below, halves,
                        share, weight + c * ROOM, excess + (BRIGHT ? c * ROOM : 0));
            global const float *odd = even + rows * columns;
            for (size_t first = 0; first < taps; first += CHUNK) {
                LANES
                for (uint i = 0; i < SPAN; i++) {
                    float part[TOGETHER];
                    __attribute__((opencl_unroll_hint(TOGETHER)))
                    for (uint c = 0; c < TOGETHER; c++) part[c] = 0.0f;
                    __attribute__((opencl_unroll_hint(CHUNK)))
                    for (uint t = 0; t < CHUNK; t++) {
                        const float value = t % 2 ? odd[first / 2 + t / 2 + i] : even[first / 2 + t / 2 + i];
                        const float dim = BRIGHT && value > limit ? limit : value, bright = value - dim;
                        __attribute__((opencl_unroll_hint(TOGETHER)))
                        for (uint c = 0; c < TOGETHER; c++) {
                            const size_t at = c * ROOM + skip + first + t;
                            part[c] += BRIGHT ? weight[at] * dim + excess[BRIGHT ? at : 0] * bright : weight[at] * value;
                        }
                    }
                    __attribute__((opencl_unroll_hint(TOGETHER)))
                    for (uint c = 0; c < TOGETHER; c++) sum[c * SPAN + i] += part[c];
                }
            }
        }
        for (uint c = 0; c < TOGETHER; c++)
            for (uint i = 0; i < SPAN; i++) total[i] += of_term[c * SPAN + i] * sum[c * SPAN + i];
    }
    add_tail(tail + colour * (2 * columns / CELL) * (rows / CELL), 2 * columns / CELL, row, 2 * column + parity, total);
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
        if (x < band.width) light[(size_t)y * band.width + x] = total[i] > 0.0f ? total[i] : 0.0f;
    }
}
