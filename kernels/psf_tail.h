// Reads the tail of point spread functions (kernels/psf_tail.cl) bilinearly between the centres of cells of CELL x CELL photosites.
#ifndef PSF_TAIL_H
#define PSF_TAIL_H
#include "conventions.h"

#if CELL
// Adds to `total` the tail at SPAN photosites of a row, each two right of the last. tail: (cell rows, cell_columns) float32, of one
// colour. row, column: of the first photosite, from the first cell's corner on.
INLINE void add_tail(global const float *tail, const size_t cell_columns, const uint row, const size_t column, float *total) {
    const uint down = row % CELL;
    const float below = ((float)(2 * down + 1) - CELL) * (0.5f / CELL), far_row = below < 0.0f ? -below : below;
    global const float *near = tail + row / CELL * cell_columns, *far = below < 0.0f ? near - cell_columns : near + cell_columns;
    for (uint i = 0; i < SPAN; i++) {
        const size_t x = column + 2 * i, cell = x / CELL;
        const float beside = ((float)(2 * (uint)(x % CELL) + 1) - CELL) * (0.5f / CELL), share = beside < 0.0f ? -beside : beside;
        const size_t next = beside < 0.0f ? cell - 1 : cell + 1;
        const float upper = near[cell] + share * (near[next] - near[cell]), lower = far[cell] + share * (far[next] - far[cell]);
        total[i] += upper + far_row * (lower - upper);
    }
}
#endif

#endif
