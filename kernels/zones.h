// Zones of the field: squares of ZONE photosites of the sensor. What changes over it is known at their corners and bilinear between
// them. A tile has TILE_ZONES zones side by side, and a row of corners above and below. ZONE 0: the same everywhere.
#ifndef ZONES_H
#define ZONES_H
#include "conventions.h"

#if ZONE
#define CORNERS 4

// Place in the zone, 0 to 1, of a photosite `x` columns or rows from any zone's first.
INLINE float zone_place(const uint x) { return ((float)(x & (ZONE - 1)) + 0.5f) * (1.0f / ZONE); }

// What a corner (0 to 3, row by row) counts at such a place.
INLINE float corner_share(const uint corner, const float right, const float down) {
    return (corner & 1 ? right : 1.0f - right) * (corner & 2 ? down : 1.0f - down);
}

// What the list (tiles, 2, TILE_ZONES + 1) says of a corner, for a photosite x columns from the tile's first.
INLINE uint zone_corner(global const uint *corners, const size_t tile, const uint corner, const uint x) {
    return corners[(2 * tile + (corner >> 1)) * (TILE_ZONES + 1) + x / ZONE + (corner & 1)];
}
#else
#define CORNERS 1

INLINE float zone_place(const uint x) { return 0.0f; }
INLINE float corner_share(const uint corner, const float right, const float down) { return 1.0f; }
INLINE uint zone_corner(global const uint *corners, const size_t tile, const uint corner, const uint x) { return 0; }
#endif

#endif
