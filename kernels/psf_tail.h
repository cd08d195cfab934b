// Reads the tail of point spread functions (kernels/psf_tail.cl) bilinearly between the centres of cells of CELL x CELL photosites.
#ifndef PSF_TAIL_H
#define PSF_TAIL_H
#include "conventions.h"

#if CELL
#define BESIDE (SPAN > 1 ? CELL / 2 : 1)

// Adds to `total` the tail at SPAN photosites of a row, each two right of the last. tail: (cell rows, cell_columns) float32, of one
// colour. row, column: of the first photosite, from the first cell's corner on.
INLINE void add_tail(global const float *tail, const size_t cell_columns, const uint row, const size_t column, float *total) {
    const uint down = row % CELL;
    const float below = ((float)(2 * down + 1) - CELL) * (0.5f / CELL), far_row = below < 0.0f ? -below : below;
    global const float *near = tail + row / CELL * cell_columns, *far = below < 0.0f ? near - cell_columns : near + cell_columns;
    float line[2 * SPAN / CELL + 3]; // cells from the one left of the span on, at the row's height
    for (uint c = 0; c < 2 * SPAN / CELL + 3; c++) {
        const float own = near[column / CELL + c - 1];
        line[c] = own + far_row * (far[column / CELL + c - 1] - own);
    }
    size_t cell[BESIDE], next[BESIDE]; // of photosites side by side, after which places in a cell recur
    float share[BESIDE];
    for (uint m = 0; m < BESIDE; m++) {
        const size_t x = column % CELL + 2 * m;
        const float beside = ((float)(2 * (uint)(x % CELL) + 1) - CELL) * (0.5f / CELL);
        cell[m] = x / CELL + 1, next[m] = beside < 0.0f ? cell[m] - 1 : cell[m] + 1, share[m] = beside < 0.0f ? -beside : beside;
    }
    for (uint i = 0; i < SPAN / BESIDE; i++)
        for (uint m = 0; m < BESIDE; m++)
            total[BESIDE * i + m] += line[cell[m] + i] + share[m] * (line[next[m] + i] - line[cell[m] + i]);
}
#endif

#endif
