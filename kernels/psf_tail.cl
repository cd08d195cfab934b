// The wide smooth part of point spread functions on cells of 2 x 2 photosites, and what it and the core are made from.
//
// planes: (CHANNELS, COLUMN_SETS, sample_rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1], a band with its margins.
//         Its first photosite has even coordinates on the sensor. Column q of each set lies in column q of the cells.
// cells:  (CHANNELS, sample_rows / COLUMN_SETS, set_columns) float32, mean of each cell.
// tail:   the same size, light of the tail at the centre of each cell.
// Cell rows and columns nearer than TAIL_TAPS / 2 to the border are not computed.
#include "conventions.h"
#include "interleaved_columns.h"

// Dimension 0: columns of cells; 1: rows of cells; 2: colours.
kernel void psf_cells(global const float *restrict planes, global float *restrict cells) {
    const size_t column = get_global_id(0), row = get_global_id(1), colour = get_global_id(2);
    const size_t columns = get_global_size(0), rows = COLUMN_SETS * get_global_size(1);
    float sum = 0.0f;
    for (uint set = 0; set < COLUMN_SETS; set++)
        for (uint j = 0; j < COLUMN_SETS; j++)
            sum += planes[row_start(COLUMN_SETS * colour + set, COLUMN_SETS * row + j, rows, columns) + column];
    cells[row_start(colour, row, get_global_size(1), columns) + column] = sum * (1.0f / (COLUMN_SETS * COLUMN_SETS));
}

// kernels: (NODE_ROWS, NODE_COLUMNS, CHANNELS, TAIL_TAPS, TAIL_TAPS) float32. limits: as in kernels/psf_gather.cl.
// first_row: first row of cells that is computed. Dimension 0: spans of cell columns, from the 32nd on; 1: rows of cells; 2: colours.
kernel void psf_tail(global const float *restrict cells, global float *restrict tail, global const float *restrict kernels,
                     global const float *restrict limits, const uint first_row, const uint cell_rows, const uint set_columns) {
    const size_t colour = get_global_id(2), row = first_row + get_global_id(1), column = 32 + SPAN * get_global_id(0);
    const size_t size = TAIL_TAPS * TAIL_TAPS, line = NODE_COLUMNS * CHANNELS * size;
    const float place = 0.5f * (limits[CHANNELS + 2 * row] + limits[CHANNELS + 2 * row + 1]);
    const size_t node = (size_t)place, below = node + 1 < NODE_ROWS ? line : 0;
    const float share = place - (float)node;
    global const float *across = limits + CHANNELS + 2 * cell_rows + 2 * column;
    global const float *from = cells + row_start(colour, row, cell_rows, set_columns) + column;
    float total[SPAN];
    for (uint i = 0; i < SPAN; i++) total[i] = 0.0f;
    for (uint n = 0; n < NODE_COLUMNS; n++) {
        global const float *weights = across + n * 2 * set_columns;
        float any = 0.0f;
        for (uint i = 0; i < 2 * SPAN; i++) any += weights[i];
        if (any == 0.0f) continue;
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
            global const float *value = from + (j - TAIL_TAPS / 2) * (long)set_columns - TAIL_TAPS / 2;
            for (uint i = 0; i < SPAN; i++) {
                float part = 0.0f;
                __attribute__((opencl_unroll_hint(TAIL_TAPS)))
                for (uint t = 0; t < TAIL_TAPS; t++) part += weight[t] * value[t + i];
                sum[i] += part;
            }
        }
        for (uint i = 0; i < SPAN; i++) total[i] += 0.5f * (weights[2 * i] + weights[2 * i + 1]) * sum[i];
    }
    for (uint i = 0; i < SPAN; i++) tail[row_start(colour, row, cell_rows, set_columns) + column + i] = total[i];
}

// Least and greatest value in each 16 rows of photosites. planes: (sets, rows, set_columns).
// extremes: (2, sets, photosite rows / 16, set_columns) float32. Dimension 0: columns of a set; 1: groups of rows; 2: column sets.
kernel void psf_extremes(global const float *restrict planes, global float *restrict extremes) {
    const size_t column = get_global_id(0), row = get_global_id(1), set = get_global_id(2), columns = get_global_size(0);
    const size_t groups = get_global_size(1), rows = 16 * OVER * groups;
    float least = planes[row_start(set, 16 * OVER * row, rows, columns) + column], greatest = least;
    for (uint j = 1; j < 16 * OVER; j++) {
        const float value = planes[row_start(set, 16 * OVER * row + j, rows, columns) + column];
        least = value < least ? value : least;
        greatest = value > greatest ? value : greatest;
    }
    extremes[row_start(set, row, groups, columns) + column] = least;
    extremes[row_start(get_global_size(2) + set, row, groups, columns) + column] = greatest;
}
