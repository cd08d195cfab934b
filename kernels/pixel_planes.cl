// Planes of a scene of one pixel per photosite that nothing displaces, in interleaved columns: the samples of projection.cl are its pixels.
// Beyond the scene's grid its edge pixels continue.
//
// planes:  (planes, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1], or coverage.
// sampled: (planes, 2, rows, set_columns) float32, interleaved columns, OVER 1.
// first_plane: of `sampled` at which writing begins. rows: of each of its planes, of which the first ones are written.
// left, top: pixel of the scene at [0, 0] of `sampled`; negative in a margin beyond the scene.
// SPAN: columns of each set that a work-item writes.
#include "conventions.h"
#include "interleaved_columns.h"
#include "plain_math.h"

// Dimension 0: spans of columns of both sets; 1: rows; 2: planes.
kernel void pixel_planes(global const float *restrict planes, global float *restrict sampled, const uint first_plane, const uint rows,
                         const uint scene_width, const uint scene_height, const int left, const int top) {
    const size_t first = SPAN * get_global_id(0), row = get_global_id(1), set = COLUMN_SETS * (first_plane + get_global_id(2));
    const size_t set_columns = SPAN * get_global_size(0);
    const int column = left + (int)(COLUMN_SETS * first);
    global const float *line = planes + (get_global_id(2) * scene_height + (size_t)clamped(top + (int)row, scene_height)) * scene_width;
    global float *even = sampled + row_start(set, row, rows, set_columns) + first, *odd = sampled + row_start(set + 1, row, rows, set_columns) + first;
    if (column >= 0 && column + COLUMN_SETS * SPAN <= (int)scene_width) {
        line += column;
        for (uint i = 0; i < SPAN; i++) even[i] = line[2 * i], odd[i] = line[2 * i + 1];
    } else {
        for (int i = 0; i < SPAN; i++) {
            even[i] = line[clamped(column + 2 * i, scene_width)];
            odd[i] = line[clamped(column + 2 * i + 1, scene_width)];
        }
    }
}
