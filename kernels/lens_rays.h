// Rays through a thin lens, as both reference blurs follow them: which rays a photosite takes, and bilinear reads of samples.
#ifndef LENS_RAYS_H
#define LENS_RAYS_H
#include "conventions.h"
#include "plain_math.h"

struct sample_grid {
    uint rows, columns; // of samples
    uint margin;        // photosites of the grid around the frame, on each side
};

struct rays {
    uint patterns;             // number of patterns of rays; a photosite's place on the sensor chooses one
    uint samples;              // rays of a pattern
    uint width;                // of the frame [photosites]
    int origin_x, origin_y;    // photosite of the sensor at [0, 0] of the frame
    float centre_x, centre_y;  // middle of the sensor [photosites from its upper left corner]
    float tangent_per_px;      // tangent of the field angle per photosite from the middle
    float cell_x, cell_y;      // middle of the cell in which images move [photosites from the sensor's upper left corner]
};

// Value of a plane at (y, x) [samples], counted from the corner of sample [row, column]: small numbers lose no digits on a large grid.
// Sample i covers [i, i + 1), and its value is that at i + 1/2.
INLINE float bilinear(global const float *plane, const int row, const int column, const float y, const float x,
                      const struct sample_grid grid) {
    const int top = whole(y - 0.5f), left = whole(x - 0.5f);
    const float t = (y - 0.5f) - (float)top, s = (x - 0.5f) - (float)left;
    const size_t y0 = (size_t)clamped(row + top, grid.rows) * grid.columns, y1 = (size_t)clamped(row + top + 1, grid.rows) * grid.columns;
    const size_t x0 = clamped(column + left, grid.columns), x1 = clamped(column + left + 1, grid.columns);
    const float upper = plane[y0 + x0] + s * (plane[y0 + x1] - plane[y0 + x0]);
    const float lower = plane[y1 + x0] + s * (plane[y1 + x1] - plane[y1 + x0]);
    return upper + t * (lower - upper);
}

// The way of a ray through a layer: where it starts [samples from the photosite's corner], and how it goes on [samples per photosite of
// radius]. point: of a kernel that defines POINT, the numbers of a ray; above 4, sixteen for each layer follow, where images move: shifts of the
// pupil and of the place in the middle of a cell, x and y each, and their growth per photosite to the right, down, and both.
// right, down: from the middle of the cell to that of the photosite.
#ifdef POINT
struct ray_path {
    float y, x, step_y, step_x;
};

INLINE float shift_at(global const float *moved, const float right, const float down) {
    return moved[0] + right * moved[4] + down * (moved[8] + right * moved[12]);
}

INLINE struct ray_path ray_path(global const float *point, const uint layer, const float right, const float down) {
    global const float *moved = point + (POINT > 4 ? 4 + 16 * layer : 0);
    struct ray_path path;
    path.y = (POINT > 4 ? point[1] + shift_at(moved + 3, right, down) : point[1]) * OVERSAMPLING;
    path.x = (POINT > 4 ? point[0] + shift_at(moved + 2, right, down) : point[0]) * OVERSAMPLING;
    path.step_y = (POINT > 4 ? point[3] + shift_at(moved + 1, right, down) : point[3]) * OVERSAMPLING;
    path.step_x = (POINT > 4 ? point[2] + shift_at(moved, right, down) : point[2]) * OVERSAMPLING;
    return path;
}
#endif

// Hash of a place on the sensor, 32 bits (the finaliser of MurmurHash3, by A. Appleby, public domain).
INLINE uint place_bits(const uint x, const uint y) {
    uint h = x * 0x9E3779B1u ^ (y * 0x85EBCA77u + 0x165667B1u);
    h = (h ^ (h >> 16)) * 0x85EBCA6Bu;
    h = (h ^ (h >> 13)) * 0xC2B2AE35u;
    return h ^ (h >> 16);
}

#if STOPS
// Whether a ray through (y, x) of the pupil [pupil radii] passes every stop (simulator/optics/pupil/pupil.py). stops: (STOPS, 2) float32,
// radius, and shift per tangent of the field angle, both [pupil radii]. field_y, field_x: tangents at the ray's place on the sensor.
INLINE bool passes(global const float *stops, const float y, const float x, const float field_y, const float field_x) {
    bool through = true;
    for (uint i = 0; i < STOPS; i++) {
        const float dy = y - stops[2 * i + 1] * field_y, dx = x - stops[2 * i + 1] * field_x;
        through = through && dy * dy + dx * dx <= stops[2 * i] * stops[2 * i];
    }
    return through;
}
#endif

#endif
