// Light where all blur circles are wide, from a picture of half the resolution. A cell, 2 x 2 photosites from the sensor's upper left
// corner on, holds their mean. The parabola through the means of three neighbours in each direction, which has these means, gives the
// mean of a photosite (average interpolation, A. Harten, J. Comput. Phys. 115, 1994): middle +- (right - left) / 8.
//
// cells:  (cell rows, cell_columns) float32, mean electron radiance of each cell in one colour [e- s^-1 um^-2 sr^-1].
// light:  (mosaics, height, width) float32 [e- s^-1 um^-2 sr^-1]; photosites of that colour in the blocks of the mosaic whose first row is
//         light_row are written.
// blocks: (blocks, 2) int32, column and row in the frame of the first photosite; negative left of the frame and above it.
// cell_x, cell_y: column and row of the cell at [0, 0] of `cells`. frame_x, frame_y: photosite of the sensor at [0, 0] of `light`.
// channel: the colour's plane.
// Dimension 0: columns of a block; 1: rows of a block; 2: blocks.
#include "cfa.h"

kernel void wide_blur(global const float *restrict cells, global float *restrict light, global const int *restrict blocks,
                      const uint channel, const int cell_columns, const int cell_x, const int cell_y, const int frame_x,
                      const int frame_y, const uint width, const uint height, const uint light_row) {
    global const int *block = blocks + 2 * get_global_id(2);
    const int column = block[0] + (int)get_global_id(0), row = block[1] + (int)get_global_id(1);
    if (column < 0 || row < 0 || column >= (int)width || row >= (int)height) return;
    if (cfa_plane((uint)column, (uint)row) != channel) return;
    const int x = frame_x + column, y = frame_y + row; // on the sensor; >> rounds down
    const float right = (x & 1) ? 0.125f : -0.125f, down = (y & 1) ? 0.125f : -0.125f;
    global const float *cell = cells + (long)((y >> 1) - cell_y) * cell_columns + ((x >> 1) - cell_x);
    float rows[3];
    for (int i = 0; i < 3; i++) {
        global const float *own = cell + (i - 1) * (long)cell_columns;
        rows[i] = own[0] + right * (own[1] - own[-1]);
    }
    light[((size_t)light_row + (size_t)row) * width + (size_t)column] = rows[1] + down * (rows[2] - rows[0]);
}
