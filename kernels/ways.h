// Order of planes that a blur reads. They hold OVER x OVER points per photosite. Column c stands at [c % WAYS][row][c / WAYS] with
// WAYS = 2 OVER, so that what photosites of one colour read at one distance lies side by side.
// A work-item computes SPAN photosites of a row and colour: the innermost loop, which CPU compilers turn into vectors. GPUs take 1.
// The host defines SPAN and OVER (1, 2 or 4).
#ifndef WAYS_H
#define WAYS_H
#include "conventions.h"

#define WAYS (2 * OVER)

// Column / WAYS, towards minus infinity.
INLINE int floor_ways(const int column) { return column >> (OVER == 4 ? 3 : OVER); }

#endif
