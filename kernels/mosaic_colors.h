// Mosaics that a launch makes (occlusion.cl, defocus.cl). light: (mosaics, height, width) float32 [e- s^-1 um^-2 sr^-1], of which a kernel
// that makes one has the first row in row_band.h. COLORS 1: in each photosite's own colour. COLORS 2 or 3: so many mosaics, one after the other,
// throughout in the colour of plane `first_color` and of the planes after it; they share all that does not depend on the colour.
#ifndef MOSAIC_COLORS_H
#define MOSAIC_COLORS_H
#include "conventions.h"
#include "row_band.h"
#define SETS 4                              // of photosites of one colour: even or odd row, even or odd column
#define PLANES (COLORS > 1 ? COLORS : SETS) // colours that are read: those of the sets, even row and even column first, or all at each photosite

// Number among these of the plane that photosites of a set read for a colour.
INLINE uint of_color(const uint color, const uint set) { return COLORS > 1 ? color : set; }

// The planes that are read. held: a layer's. colour: column sets before each of them. plane: elements of a column set.
INLINE void set_planes(global const float **light, global const float *held, const long *colour, const long plane) {
    __attribute__((opencl_unroll_hint(PLANES)))
    for (uint i = 0; i < PLANES; i++) light[i] = held + colour[i] * plane;
}

// Element of a mosaic. color: of the launch. x, y: photosite of the frame.
INLINE size_t mosaic_element(const uint color, const uint x, const uint y, const struct row_band band) {
    return ((size_t)band.light_row + (size_t)color * band.height + y) * band.width + x;
}

// Writes light, or adds it to what is there.
INLINE void set_light(global float *result, const int adds, const float light) { *result = adds ? *result + light : light; }

#endif
