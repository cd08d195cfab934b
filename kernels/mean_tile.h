// Tiles of which defocus.cl computes the mean over the image of the aperture, without the blocks that sample it.
#ifndef MEAN_TILE_H
#define MEAN_TILE_H
#include "conventions.h"

struct tile {
    uint column, row;        // first photosite in the band: column within its set, row of photosites
    uint first_node, nodes;  // in `nodes`, or with zones in a corner's list; 0 nodes: the surface is sharp and is copied
    uint left_out;           // a bit for each of its blocks, row by row, which are computed by other kernels: these photosites are not
};

#define TILE_BLOCKS (TILE_COLUMNS / BLOCK_COLUMNS) // side by side

// Whether a photosite belongs to a block that is left out. x, y: column and row of photosites in the tile.
INLINE uint is_left_out(const struct tile tile, const uint x, const uint y) {
    return tile.left_out >> (y / BLOCK_ROWS * TILE_BLOCKS + x / BLOCK_COLUMNS) & 1u;
}

#endif
