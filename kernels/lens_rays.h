// What rays through a lens read: samples around a photosite, and a pattern of points by place on the sensor.
#ifndef LENS_RAYS_H
#define LENS_RAYS_H
#include "conventions.h"

INLINE int clamped(const int i, const uint count) { return i < 0 ? 0 : (i < (int)count ? i : (int)count - 1); }
INLINE int whole(const float v) { return (int)v - (v < (float)(int)v ? 1 : 0); }

// Value at (y, x) samples from the corner of sample [row, column]; sample i covers [i, i + 1), its value stands at i + 1/2.
INLINE float bilinear(global const float *plane, const int row, const int column, const float y, const float x, const uint rows,
                      const uint columns) {
    const int top = whole(y - 0.5f), left = whole(x - 0.5f);
    const float t = (y - 0.5f) - (float)top, s = (x - 0.5f) - (float)left;
    const size_t y0 = (size_t)clamped(row + top, rows) * columns, y1 = (size_t)clamped(row + top + 1, rows) * columns;
    const size_t x0 = clamped(column + left, columns), x1 = clamped(column + left + 1, columns);
    const float upper = plane[y0 + x0] + s * (plane[y0 + x1] - plane[y0 + x0]);
    const float lower = plane[y1 + x0] + s * (plane[y1 + x1] - plane[y1 + x0]);
    return upper + t * (lower - upper);
}

// 32 bits that look random of a place on the sensor (the finaliser of MurmurHash3, by A. Appleby, public domain).
INLINE uint place_bits(const uint x, const uint y) {
    uint h = x * 0x9E3779B1u ^ (y * 0x85EBCA77u + 0x165667B1u);
    h = (h ^ (h >> 16)) * 0x85EBCA6Bu;
    h = (h ^ (h >> 13)) * 0xC2B2AE35u;
    return h ^ (h >> 16);
}

#if STOPS
// Whether a ray through (y, x) of the pupil passes stops, (STOPS, 2): radius, and shift per tangent of the field angle, both in
// pupil radii (simulator/lens/pupil.py). field_y, field_x: tangents at the ray's place on the sensor.
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
