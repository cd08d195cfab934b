// The wide smooth part of point spread functions on cells of CELL x CELL photosites, 2 or 4, and what it is made from.
//
// planes: (CHANNELS, COLUMN_SETS, sample_rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1], a band with its margins.
//         Its first photosite's coordinates on the sensor are multiples of CELL. Columns q CELL / 2 of each set begin column q of the cells.
// cells:  (CHANNELS, rows of photosites / CELL, cell_columns) float32, mean of each cell.
// tail:   the same size, light of the tail at the centre of each cell.
// Cell rows and columns nearer than TAIL_TAPS / 2 to the border are not computed.
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"

// Dimension 0: spans of cell columns; 1: rows of cells; 2: colours.
kernel void psf_cells(global const float *restrict planes, global float *restrict cells) {
    const size_t column = SPAN * get_global_id(0), row = get_global_id(1), colour = get_global_id(2);
    const size_t cell_columns = SPAN * get_global_size(0), columns = CELL / 2 * cell_columns, rows = OVER * CELL * get_global_size(1);
    float sum[CELL / 2 * SPAN];
    for (uint i = 0; i < CELL / 2 * SPAN; i++) sum[i] = 0.0f;
    for (uint set = 0; set < COLUMN_SETS; set++)
        for (uint j = 0; j < OVER * CELL; j++) {
            global const float *from = planes + row_start(COLUMN_SETS * colour + set, OVER * CELL * row + j, rows, columns) + CELL / 2 * column;
            for (uint i = 0; i < CELL / 2 * SPAN; i++) sum[i] += from[i];
        }
    global float *to = cells + row_start(colour, row, get_global_size(1), cell_columns) + column;
    for (uint i = 0; i < SPAN; i++)
        to[i] = (CELL == 4 ? sum[CELL / 2 * i] + sum[CELL / 2 * i + 1] : sum[i]) * (1.0f / (OVER * OVER * CELL * CELL));
}

// kernels: (NODE_ROWS, NODE_COLUMNS, CHANNELS, TAIL_TAPS, TAIL_TAPS) float32. limits: as in kernels/psf_gather.cl.
// first_row: first row of cells that is computed. Dimension 0: spans of cell columns, from column MARGIN on; 1: rows of cells; 2: colours.
kernel void psf_tail(global const float *restrict cells, global float *restrict tail, global const float *restrict kernels,
                     global const float *restrict limits, const uint first_row, const uint cell_rows, const uint cell_columns) {
    const size_t colour = get_global_id(2), row = first_row + get_global_id(1), column = MARGIN + SPAN * get_global_id(0);
    const size_t size = TAIL_TAPS * TAIL_TAPS, line = NODE_COLUMNS * CHANNELS * size;
    global const float *places = limits + CHANNELS + CELL * row + CELL / 2;
    const float place = 0.5f * (places[-1] + places[0]); // of the middle of the cells
    const size_t node = (size_t)place, below = node + 1 < NODE_ROWS ? line : 0;
    const float share = place - (float)node;
    global const float *across = limits + CHANNELS + CELL * (cell_rows + column);
    global const float *from = cells + row_start(colour, row, cell_rows, cell_columns) + column;
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    for (uint n = 0; n < NODE_COLUMNS; n++) {
        global const float *weights = across + n * CELL * cell_columns;
        uint any = NODE_COLUMNS == 1;
        for (uint i = 0; NODE_COLUMNS > 1 && i < CELL * SPAN; i++) any |= weights[i] > 0.0f;
        if (!any) continue;
        global const float *of_node = kernels + node * line + (n * CHANNELS + colour) * size;
        float sum[SPAN];
        for (uint i = 0; i < SPAN; i++) sum[i] = 0.0f;
        for (int j = 0; j < TAIL_TAPS; j++) {
            float weight[TAIL_TAPS];
            __attribute__((opencl_unroll_hint(TAIL_TAPS)))
            for (uint t = 0; t < TAIL_TAPS; t++) {
                const float upper = of_node[j * TAIL_TAPS + t];
                weight[t] = upper + share * (of_node[below + j * TAIL_TAPS + t] - upper);
            }
            global const float *value = from + (j - TAIL_TAPS / 2) * (long)cell_columns - TAIL_TAPS / 2;
            LANES
            for (uint i = 0; i < SPAN; i++) {
                float part = 0.0f;
                __attribute__((opencl_unroll_hint(TAIL_TAPS)))
                for (uint t = 0; t < TAIL_TAPS; t++) part += weight[t] * value[t + i];
                sum[i] += part;
            }
        }
        for (uint i = 0; i < SPAN; i++)
            total[i] += NODE_COLUMNS > 1 ? 0.5f * (weights[CELL * i + CELL / 2 - 1] + weights[CELL * i + CELL / 2]) * sum[i] : sum[i];
    }
    for (uint i = 0; i < SPAN; i++) tail[row_start(colour, row, cell_rows, cell_columns) + column + i] = total[i];
}
