// Colour plane of a photosite behind the colour filter array (0 R, 1 G, 2 B; all 0 without a filter); column and row count from the
// frame's upper left corner. The host defines CFA_00, CFA_01, CFA_10, CFA_11, the planes of a pattern of 2 x 2 photosites,
// [row][column], or of a larger one CFA_ROWS, CFA_COLUMNS and CFA_TABLE, its planes row by row.
#ifndef CFA_H
#define CFA_H
#include "conventions.h"

#ifdef CFA_TABLE
constant uchar cfa_table[CFA_ROWS * CFA_COLUMNS] = CFA_TABLE;
INLINE uint cfa_plane(const uint column, const uint row) { return cfa_table[row % CFA_ROWS * CFA_COLUMNS + column % CFA_COLUMNS]; }
#else
INLINE uint cfa_plane(const uint column, const uint row) {
    return (row & 1u) ? ((column & 1u) ? CFA_11 : CFA_10) : ((column & 1u) ? CFA_01 : CFA_00);
}
#endif

#endif
