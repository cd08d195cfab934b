// Point spread functions by direct sums: each photosite gathers light in its own colour only, with a core on the samples of the light
// and with a wide smooth tail on cells of CELL x CELL photosites (kernels/psf_tail.cl).
//   light(x) = tail(x) + sum over terms n of weight_n(x) * sum over taps t of kernel_n(t) * planes(x + t)
// A term is the kernel of one blur radius and one column of nodes on the sensor; the node rows above and below a photosite are mixed.
//
// planes:  (CHANNELS, COLUMN_SETS, sample_rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1], a band with its margins;
//          interleaved columns. Its first photosite has even coordinates on the sensor, whose filter cfa.h holds.
// tail:    (CHANNELS, rows of photosites / CELL, 2 set_columns / CELL) float32, light of the tail at the cells' centres; CELL 0: not read.
// radius:  (2, sample_rows, set_columns) float32, signed blur radius [photosites] of the surface that a photosite sees; MAPPED 0: not
//          read. MAPPED 1 adds a correction whose kernels have the sum 0, OVER is 1 then. With STEPS, light of a surface whose blur
//          radius differs by more than `edge` photosites counts as that of the photosite itself.
// light:   (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1].
// tiles:   (tiles) struct tile. terms: (terms) struct term, of all tiles.
// kernels: (1 + BRIGHT, radii, NODE_ROWS, NODE_COLUMNS, CHANNELS, TAPS_Y, TAPS_X) float32; the second half is for light above `limits`.
// limits:  (CHANNELS) float32 [e- s^-1 um^-2 sr^-1], then (rows) place of each row of photosites between the node rows, then
//          (NODE_COLUMNS, 2 set_columns) weight of each node column at each column of photosites.
// radii:   blur radii in `kernels`. FIRST_X, FIRST_Y: first sample of the taps, relative to the photosite's first sample.
// ADDS 0: the last of the kernels, after which light below 0 becomes 0.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "psf_tail.h"
#include "row_band.h"

struct tile {
    uint column, row;       // first photosite in the band: column within its set, row of photosites
    uint first_term, terms; // in `terms`
};

struct term {
    uint number, node_column;  // kernel: number of its blur radius, column of nodes
    float radius, rise, fall;  // weight: 1 at this radius, less by `rise` and by `fall` for each photosite of radius below and above it
};

// Weight of a term for a signed blur radius [photosites].
INLINE float radius_weight(const struct term term, const float radius) {
    const float away = radius - term.radius, weight = 1.0f - (away < 0.0f ? -away * term.rise : away * term.fall);
    return weight > 0.0f ? weight : 0.0f;
}

// Dimension 0: spans of a tile; 1: its rows of photosites, each as even and odd columns; 2: tiles.
kernel void psf_gather(global const float *restrict planes, global const float *restrict tail, global const float *restrict radius,
                       global float *restrict light, global const struct tile *restrict tiles,
                       global const struct term *restrict terms, global const float *restrict kernels,
                       global const float *restrict limits, const uint radii, const float edge, const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct tile tile = tiles[get_global_id(2)];
    const uint row = tile.row + (uint)(get_global_id(1) >> 1), y = (uint)band.frame_y + row; // y wraps above the frame
    const size_t column = tile.column + get_global_id(0) * SPAN;
    if (y >= band.height) return;
    const size_t colour = cfa_plane(parity, row), size = TAPS_Y * TAPS_X, line = NODE_COLUMNS * CHANNELS * size;
    const float limit = limits[colour], place = limits[CHANNELS + row];
    const size_t node = (size_t)place, below = node + 1 < NODE_ROWS ? line : 0, bright = BRIGHT * radii * NODE_ROWS * line;
    const float share = place - (float)node;
    global const float *across = limits + CHANNELS + rows / OVER + 2 * column + parity;
    global const float *from = planes + row_start(COLUMN_SETS * colour, OVER * row, rows, columns) + FIRST_Y * (long)columns + column;
    global const float *sharp = planes + row_start(COLUMN_SETS * colour + parity, row, rows, columns) + column;
    global const float *own = radius + row_start(parity, row, rows, columns) + column;
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n++) {
        const struct term term = terms[n];
        global const float *of_term = kernels + (term.number * NODE_ROWS + node) * line + (term.node_column * CHANNELS + colour) * size;
        global const float *column_weight = across + term.node_column * 2 * columns;
        float sum[SPAN], all = 0.0f;
        for (uint i = 0; i < SPAN; i++) sum[i] = 0.0f;
        for (uint i = 0; i < SPAN; i++) all += column_weight[2 * i] * (MAPPED ? radius_weight(term, own[i]) : 1.0f);
        if (all == 0.0f) continue; // no photosite of the span has this term
        for (uint j = 0; j < TAPS_Y; j++) {
            float weight[TAPS_X], excess[TAPS_X];
            __attribute__((opencl_unroll_hint(TAPS_X)))
            for (uint t = 0; t < TAPS_X; t++) {
                global const float *tap = of_term + j * TAPS_X + t;
                weight[t] = tap[0] + share * (tap[below] - tap[0]);
                excess[t] = BRIGHT ? tap[bright] + share * (tap[bright + below] - tap[bright]) : 0.0f;
            }
            for (uint i = 0; i < SPAN; i++) {
                float part = 0.0f;
                __attribute__((opencl_unroll_hint(TAPS_X)))
                for (uint t = 0; t < TAPS_X; t++) {
                    const int sample = (int)(OVER * parity + t) + FIRST_X;
                    const long at = (column_set(sample) * (long)rows + j) * (long)columns + column_in_set(sample) + i;
                    float value = from[at];
#if STEPS
                    const float away = radius[((FIRST_Y + (long)row) * (long)columns + (long)column) + at] - own[i];
                    value = away * away < edge * edge ? value : sharp[i];
#endif
                    const float dim = BRIGHT && value > limit ? limit : value;
                    part += BRIGHT ? weight[t] * dim + excess[t] * (value - dim) : weight[t] * value;
                }
                sum[i] += part;
            }
        }
        for (uint i = 0; i < SPAN; i++)
            total[i] += column_weight[2 * i] * (MAPPED ? radius_weight(term, own[i]) : 1.0f) * sum[i];
    }
#if CELL
    add_tail(tail + colour * (2 * columns / CELL) * (rows / OVER / CELL), 2 * columns / CELL, row, 2 * column + parity, total);
#endif
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
        if (x >= band.width) continue;
        const float found = light[(size_t)y * band.width + x] + total[i];
        light[(size_t)y * band.width + x] = ADDS || found > 0.0f ? found : 0.0f;
    }
}
