// Least and greatest light, or blur radius, of groups of rows: which tiles need which variant of kernels/psf_gather.cl.
//
// planes:   (sets, rows, set_columns) float32, interleaved columns. EXTREME_ROWS: rows of photosites of a group.
// extremes: (2, sets, photosite rows / EXTREME_ROWS, set_columns) float32.
#include "conventions.h"
#include "interleaved_columns.h"

// Dimension 0: columns of a set; 1: groups of rows; 2: column sets.
kernel void psf_extremes(global const float *restrict planes, global float *restrict extremes) {
    const size_t column = get_global_id(0), row = get_global_id(1), set = get_global_id(2), columns = get_global_size(0);
    const size_t groups = get_global_size(1), rows = EXTREME_ROWS * OVER * groups;
    float least = planes[row_start(set, EXTREME_ROWS * OVER * row, rows, columns) + column], greatest = least;
    for (uint j = 1; j < EXTREME_ROWS * OVER; j++) {
        const float value = planes[row_start(set, EXTREME_ROWS * OVER * row + j, rows, columns) + column];
        least = value < least ? value : least;
        greatest = value > greatest ? value : greatest;
    }
    extremes[row_start(set, row, groups, columns) + column] = least;
    extremes[row_start(get_global_size(2) + set, row, groups, columns) + column] = greatest;
}
