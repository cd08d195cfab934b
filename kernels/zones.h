// Zones of the field, where rims cut the pupil (cat's eyes): squares of ZONE x ZONE photosites of the sensor. The pupil is known at
// the corners of each zone, and a mean over it is interpolated bilinearly between the zone's four corners. A tile has TILE_ZONES zones
// side by side, all in one row of zones. ZONE, a power of two; 0: the pupil is the same everywhere, and one corner stands for all.
#ifndef ZONES_H
#define ZONES_H
#include "conventions.h"

#if ZONE
#define CORNERS 4

// Place of a photosite's centre across its zone, 0 to 1; x: columns or rows from the first of any zone [photosites].
INLINE float zone_place(const uint x) { return ((float)(x & (ZONE - 1)) + 0.5f) * (1.0f / ZONE); }

// Bilinear weight of a corner (0 to 3, row by row) at a place in the zone (0 to 1 each).
INLINE float corner_share(const uint corner, const float right, const float down) {
    return (corner & 1 ? right : 1.0f - right) * (corner & 2 ? down : 1.0f - down);
}

// Entry of corners, (tiles, 2, TILE_ZONES + 1) uint32, for a corner of the zone of a photosite x columns from the tile's first.
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
