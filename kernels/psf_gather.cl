// Point spread functions by direct sums: each photosite gathers light in its own colour only, with a core on the samples of the light
// and with a wide smooth tail on cells of CELL x CELL photosites (kernels/psf_tail.cl).
//   light(x) = tail(x) + sum over terms n of weight_n(x) * sum over taps t of kernel_n(t) * planes(x + t)
// A term is the kernel of one blur radius and one column of nodes on the sensor; the node rows above and below a photosite are mixed.
//
// planes:  (channels, COLUMN_SETS, sample_rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1], a band with its margins;
//          interleaved columns. Its first photosite has even coordinates on the sensor.
// tail:    (channels, rows of photosites / CELL, 2 set_columns / CELL) float32, light of the tail at the cells' centres; CELL 0: not read.
// radius:  (2, sample_rows, set_columns) float32, signed blur radius [photosites] of the surface that a photosite sees; MAPPED 0: not
//          read. MAPPED 1 adds a correction whose kernels have the sum 0, OVER is 1 then. With STEPS, light of a surface whose blur
//          radius differs by more than `edge` photosites counts as that of the photosite itself.
// light:   (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1].
// tiles:   (tiles) struct tile. terms: (terms) struct term, of all tiles.
// kernels: (1 + BRIGHT, radii, NODE_ROWS, NODE_COLUMNS, channels, HELD_Y, HELD_X) float32; the second half is for light above `limits`.
//          FOLD_Y, FOLD_X 1: TAPS_Y rows, TAPS_X columns of a kernel mirror each other, and the first half of them is held, with half
//          the weight in the middle. TOGETHER: terms that are summed in one go, a divisor of each tile's number of terms.
// limits:  (channels) float32 [e- s^-1 um^-2 sr^-1], then (rows) place of each row of photosites between the node rows, then
//          (NODE_COLUMNS, 2 set_columns) weight of each node column at each column of photosites.
// radii:   blur radii in `kernels`. FIRST_X, FIRST_Y: first sample of the taps, relative to the photosite's first sample.
// ADDS 0: the last of the kernels, after which light below 0 becomes 0.
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "psf_row.h"
#include "psf_tail.h"
#include "psf_terms.h"
#include "row_band.h"

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
    const size_t colour = band_color((uint)parity, row, band), channels = band.channels, size = HELD_Y * HELD_X, line = NODE_COLUMNS * channels * size;
    const float limit = limits[colour], place = limits[channels + row];
    const size_t node = (size_t)place, below = node + 1 < NODE_ROWS ? line : 0, bright = BRIGHT * radii * NODE_ROWS * line;
    const float share = place - (float)node;
    global const float *across = limits + channels + rows / OVER + 2 * column + parity;
    global const float *from = planes + row_start(COLUMN_SETS * colour, OVER * row, rows, columns) + FIRST_Y * (long)columns + column;
    global const float *sharp = planes + row_start(COLUMN_SETS * colour + parity, row, rows, columns) + column;
    global const float *own = radius + row_start(parity, row, rows, columns) + column;
    global const float *around = radius + row_start(0, row, rows, columns) + FIRST_Y * (long)columns + column;
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    for (uint n = tile.first_term; n < tile.first_term + tile.terms; n += TOGETHER) {
        float sum[TOGETHER * SPAN], own_share[TOGETHER * SPAN];
        uint any = 0;
        for (uint k = 0; k < TOGETHER; k++) any |= term_weights(terms[n + k], across, columns, own, own_share + k * SPAN);
        if (!any) continue; // no photosite of the span has these terms
        for (uint i = 0; i < TOGETHER * SPAN; i++) sum[i] = 0.0f;
        for (uint j = 0; j < HELD_Y; j++) {
            float weight[TOGETHER * HELD_X], excess[TOGETHER * HELD_X];
            for (uint k = 0; k < TOGETHER; k++) {
                global const float *of_term = kernels + (terms[n + k].number * NODE_ROWS + node) * line;
                __attribute__((opencl_unroll_hint(HELD_X)))
                for (uint t = 0; t < HELD_X; t++) {
                    global const float *tap = of_term + (terms[n + k].node_column * channels + colour) * size + j * HELD_X + t;
                    weight[k * HELD_X + t] = NODE_ROWS > 1 ? tap[0] + share * (tap[below] - tap[0]) : tap[0];
                    const float high = BRIGHT ? tap[bright] : 0.0f;
                    excess[k * HELD_X + t] = (BRIGHT & (NODE_ROWS > 1)) ? high + share * (tap[bright + below] - high) : high;
                }
            }
            const long mirror = (TAPS_Y - 1 - 2 * (long)j) * (long)columns;
#if !STEPS
            float dims[COLUMN_SETS * WIDE], aboves[BRIGHT ? COLUMN_SETS * WIDE : 1];
            read_row(from + j * columns, rows * columns, mirror, parity, limit, dims, aboves);
#endif
            LANES
            for (uint i = 0; i < SPAN; i++) {
                float part[TOGETHER];
                for (uint k = 0; k < TOGETHER; k++) part[k] = 0.0f;
                __attribute__((opencl_unroll_hint(HELD_X)))
                for (uint t = 0; t < HELD_X; t++) {
                    float dim = 0.0f, above = 0.0f; // light that has the same weights, up to the limit and beyond
                    __attribute__((opencl_unroll_hint(1 + FOLD_X)))
                    for (uint m = 0; m < 1 + FOLD_X; m++) {
                        const int right = (int)(OVER * parity + (m ? TAPS_X - 1 - t : t)) + FIRST_X;
#if STEPS
                        const long at = column_start(right, (long)(rows * columns)) + (long)(j * columns) + i;
                        add_near(from + at, around + at, own[i], sharp[i], mirror, edge, limit, &dim, &above);
#else
                        dim += dims[place_in_row(right) + i];
                        above += BRIGHT ? aboves[place_in_row(right) + i] : 0.0f;
#endif
                    }
                    for (uint k = 0; k < TOGETHER; k++)
                        part[k] += BRIGHT ? weight[k * HELD_X + t] * dim + excess[k * HELD_X + t] * above : weight[k * HELD_X + t] * dim;
                }
                for (uint k = 0; k < TOGETHER; k++) sum[k * SPAN + i] += part[k];
            }
        }
        for (uint k = 0; k < TOGETHER; k++)
            for (uint i = 0; i < SPAN; i++) total[i] += own_share[k * SPAN + i] * sum[k * SPAN + i];
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
