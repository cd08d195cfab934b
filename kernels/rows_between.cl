// Planes of a layer at evenly spaced places between two of its rows (phases), of which swept_layers.cl reads one row for each photosite and
// point of aperture and time: the nearest. Their columns lie in STEP sets, every STEP-th of the scene's in one. Beyond the layer its edge
// pixels continue.
//
// planes: (planes, scene height, scene width) float32, of a layer.
// between: (PHASES, planes, rows, columns) float32, of the scene's rows from first_row on and its columns from first_column on.
// SPAN: columns of a set and a work-item, which loads pixels once for all phases.
#include "conventions.h"
#include "bilinear_area.h"
#include "lanes.h"

struct between {
    int first_row, first_column;    // of the scene [px]
    uint rows, columns;             // of `between`; columns are a multiple of STEP SPAN
    uint plane_count, first_plane;  // of a layer; of those that are written
    uint scene_width, scene_height; // of the scene's grid [px]
};

// Dimension 0: spans of a row, those of a set beside each other; 1: rows; 2: planes.
kernel void rows_between(global const float *restrict planes, global float *restrict between, const struct between layer) {
    const size_t column = get_global_id(0) * SPAN, row = get_global_id(1), plane = layer.first_plane + get_global_id(2);
    const uint set_columns = layer.columns / STEP, set = (uint)(column / set_columns);
    const int first = layer.first_column + (int)(set + STEP * (column - set * set_columns)), y = layer.first_row + (int)row;
    global const float *const own = planes + plane * layer.scene_height * layer.scene_width;
    global const float *const above = own + (size_t)clamped(y, layer.scene_height) * layer.scene_width;
    global const float *const below = own + (size_t)clamped(y + 1, layer.scene_height) * layer.scene_width;
    float upper[SPAN], growth[SPAN];
    for (int i = 0; i < SPAN; i++) {
        const int x = clamped(first + STEP * i, layer.scene_width);
        upper[i] = above[x], growth[i] = below[x] - above[x];
    }
    for (size_t phase = 0; phase < PHASES; phase++) {
        global float *line = between + ((phase * layer.plane_count + plane) * layer.rows + row) * layer.columns + column;
        const float share = (float)phase * (1.0f / PHASES);
        LANES
        for (int i = 0; i < SPAN; i++) line[i] = upper[i] + share * growth[i];
    }
}
