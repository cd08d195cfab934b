// Means of the rows of a layer over the width of photosites, at evenly spaced places between them (phases), of which swept_layers.cl reads
// two for each photosite and row: those beside the place where it sees the layer at an instant.
//
// planes: (planes, scene height, scene width) float32, of a layer.
// pixels: (phases, READS, columns) int32, the scene's columns that a photosite touches; those beyond the scene are its edge.
// shares: (phases, READS, columns) float32, share of each in the photosite's width.
// means:  (phases, planes, rows, columns) float32, of the scene's rows from first_row on, each as STEP sets of columns.
// SPAN, ROWS: columns and rows of a work-item.
#include "conventions.h"

struct phases {
    uint first_row, rows, columns;  // of `means`; columns are a multiple of STEP and SPAN
    uint plane_count;               // of a layer
    uint first_plane, planes_written; // the first of those that are written, and how many
    uint scene_width, scene_height; // of the scene's grid [px]
};

// Dimension 0: spans of a row; 1: blocks of ROWS rows; 2: phases of planes.
kernel void layer_phases(global const float *restrict planes, global const int *restrict pixels, global const float *restrict shares,
                         global float *restrict means, const struct phases phases) {
    const size_t column = get_global_id(0) * SPAN, phase = get_global_id(2) / phases.planes_written;
    const size_t plane = phases.first_plane + get_global_id(2) % phases.planes_written, table = phase * READS * phases.columns + column;
    global const int *from = pixels + table;
    global const float *share = shares + table;
    const size_t row = get_global_id(1) * ROWS, left = phases.rows - row; // from this row to the last
    global const float *line = planes + (plane * phases.scene_height + phases.first_row + row) * phases.scene_width;
    global float *mean = means + ((phase * phases.plane_count + plane) * phases.rows + row) * phases.columns;
    for (uint i = 0; i < SPAN; i++) {
        const size_t place = (column + i) % STEP * (phases.columns / STEP) + (column + i) / STEP;
        int own[READS];
        float part[READS];
        for (uint k = 0; k < READS; k++) own[k] = from[k * phases.columns + i], part[k] = share[k * phases.columns + i];
        __attribute__((opencl_unroll_hint(ROWS)))
        for (uint n = 0; n < ROWS; n++) {
            const size_t down = n < left ? n : left - 1; // the last row again
            float sum = 0.0f;
            __attribute__((opencl_unroll_hint(READS)))
            for (uint k = 0; k < READS; k++) sum += part[k] * line[down * phases.scene_width + (size_t)own[k]];
            mean[down * phases.columns + place] = sum;
        }
    }
}
