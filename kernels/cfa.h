// Colour plane of a photosite behind the colour filter array. The host defines CFA_00, CFA_01, CFA_10, CFA_11: the plane (0 R,
// 1 G, 2 B; all 0 without a filter) of the 2x2 block at the frame's upper left corner, [row][column].
#ifndef CFA_H
#define CFA_H
#include "conventions.h"

INLINE uint cfa_plane(const uint column, const uint row) {
    return (row & 1u) ? ((column & 1u) ? CFA_11 : CFA_10) : ((column & 1u) ? CFA_01 : CFA_00);
}

#endif
