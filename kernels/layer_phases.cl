// Means of the rows of a layer over the width of photosites, at evenly spaced places between them (phases), of which swept_layers.cl reads
// two for each photosite and row: those beside the place where it sees the layer at an instant.
//
// planes: (planes, scene height, scene width) float32, of a layer.
// pixels: (SLOTS, columns) int32, the scene's columns that a photosite touches at any phase; those beyond the scene are its edge.
// begins: (phases) int32, number of the first slot that any photosite touches at a phase, up to SLOTS - TAPS.
// shares: (phases, TAPS, columns) float32, share of each slot from there on in the photosite's width.
// means:  (phases, planes, rows, columns) float32, of the scene's rows from first_row on.
// SPAN, ROWS: columns and rows of a work-item, which loads the pixels of a row once for all phases.
#include "conventions.h"
#include "lanes.h"

struct phases {
    uint first_row, rows, columns;  // of `means`; columns are a multiple of SPAN
    uint count, plane_count;        // of phases; of a layer's planes
    uint first_plane;               // of those that are written
    uint scene_width, scene_height; // of the scene's grid [px]
};

// Dimension 0: spans of a row; 1: blocks of ROWS rows; 2: planes.
kernel void layer_phases(global const float *restrict planes, global const int *restrict pixels, global const int *restrict begins,
                         global const float *restrict shares, global float *restrict means, const struct phases phases) {
    const size_t column = get_global_id(0) * SPAN, plane = phases.first_plane + get_global_id(2), first = get_global_id(1) * ROWS;
    const size_t last = first + ROWS < phases.rows ? first + ROWS : phases.rows;
    global const float *line = planes + (plane * phases.scene_height + phases.first_row + first) * phases.scene_width;
    size_t down[ROWS]; // of each row from the first [px]; the last row again
    for (size_t n = 0; n < ROWS; n++) down[n] = (first + n < last ? n : last - 1 - first) * phases.scene_width;
    float slots[ROWS * SLOTS * SPAN];
    for (uint j = 0; j < SLOTS; j++)
        for (uint i = 0; i < SPAN; i++) {
            global const float *own = line + pixels[j * phases.columns + column + i];
            __attribute__((opencl_unroll_hint(ROWS)))
            for (uint n = 0; n < ROWS; n++) slots[(n * SLOTS + j) * SPAN + i] = own[down[n]];
        }
    for (size_t row = first; row < last; row++) {
        const float *own = slots + (row - first) * (SLOTS * SPAN);
        for (size_t phase = 0; phase < phases.count; phase++) {
            const float *slot = own + begins[phase] * SPAN;
            global const float *share = shares + phase * TAPS * phases.columns + column;
            global float *mean = means + ((phase * phases.plane_count + plane) * phases.rows + row) * phases.columns + column;
            LANES
            for (uint i = 0; i < SPAN; i++) {
                float sum = 0.0f;
                __attribute__((opencl_unroll_hint(TAPS)))
                for (uint k = 0; k < TAPS; k++) sum += share[k * phases.columns + i] * slot[k * SPAN + i];
                mean[i] = sum;
            }
        }
    }
}
