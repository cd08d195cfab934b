// Layout of sample planes in interleaved columns, which every kernel of the lens blur reads and writes.
//
// A photosite has OVER x OVER samples. Photosites of one colour lie two photosites, that is COLUMN_SETS = 2 OVER samples, apart.
// A plane (rows, columns) is therefore stored as COLUMN_SETS sets of columns, (COLUMN_SETS, rows, set_columns):
//   sample [row][column] stands at [column % COLUMN_SETS][row][column / COLUMN_SETS]
// so that photosites of one colour in a row read adjacent floats at any one offset, which compilers turn into vector loads.
// simulator/optics/geometry/interleaved_columns.py encodes and decodes the same layout on the host.
//
// The host defines OVER, samples per photosite and axis (1 to 4), and SPAN, photosites of one row and colour that a work-item
// computes in its innermost loop: 64 on CPUs, whose compilers vectorise that loop, 1 on GPUs.
#ifndef INTERLEAVED_COLUMNS_H
#define INTERLEAVED_COLUMNS_H
#include "conventions.h"

#define COLUMN_SETS (2 * OVER)
#define FAR_SETS 65536 // a negative column plus so many sets of columns is positive

// Column set that holds a column of samples; the column may be negative.
INLINE int column_set(const int column) {
    return OVER == 3 ? (column + FAR_SETS * COLUMN_SETS) % COLUMN_SETS : column & (COLUMN_SETS - 1);
}

// Place of a column of samples within its set: column / COLUMN_SETS, rounded towards minus infinity.
INLINE int column_in_set(const int column) {
    return OVER == 3 ? (column + FAR_SETS * COLUMN_SETS) / COLUMN_SETS - FAR_SETS : column >> (OVER == 4 ? 3 : OVER);
}

// Element at which a row of a column set begins; sets are counted through all planes: COLUMN_SETS * plane + column_set.
INLINE size_t row_start(const size_t set, const size_t row, const size_t rows, const size_t set_columns) {
    return (set * rows + row) * set_columns;
}

// Elements from a plane's start to the first row of a column of samples, which may be negative; elements: of a column set.
INLINE long column_start(const int column, const long elements) { return column_set(column) * elements + column_in_set(column); }

#endif
