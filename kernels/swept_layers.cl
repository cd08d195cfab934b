// Image of layers that move as a whole and apart while the shutter is open, without a turn: for each photosite the mean over instants of what
// it sees through nearer layers. Each layer is read between two pixels of some rows, at an instant at the same place by all photosites of a
// line. Behind a lens that blurs each layer by one radius an instant goes with a point of the aperture. The planes have one pixel for each
// photosite, or for each sample of one: they are the scene's own, or means over photosites at places between them (layer_phases.cl).
// Layers behind the last of those that differ from instant to instant are read once.
// STEP 2: a mosaic behind a colour filter, even and odd columns apart. STEP 1: a plane of one colour.
//
// layer_0, layer_1, layer_2, layer_3: (phases, planes, grid height, grid width) float32 of each of LAYERS layers, the nearest first:
//         CHANNELS planes of electron radiance times coverage [e- s^-1 um^-2 sr^-1]; and coverage, 0 to 1, but of the last. The first MOVING
//         of them differ from instant to instant. Those from LAYERS on are not read. Beyond a layer its edge pixels continue.
// spots:  (lines, instants, LAYERS) struct spot; one line, or one for each `rows` rows. Of a layer at rest the first instant counts.
// row_spots: READS 1: the same of struct row_spot, instead of `spots`, of planes between rows (rows_between.cl).
// views:  DRIFTS 1: (lines, instants, LAYERS) struct view (row_view.h), instead of `spots`; displacements change a little along a row.
// places: (rows of the launch,) struct row_place; not read where the planes have one pixel for each photosite (EDGES 1).
// weights: (lines, instants) float32, share of each instant in the line's light.
// mosaic: (rows, width) float32 from mosaic_row on, each photosite's own colour.
#include "conventions.h"
#include "cfa.h"
#include "layer_spans.h"

#if DRIFTS
#define FIND_SPOT(instant, n) spot_of(drift_at(views[(instant) * LAYERS + n], (float)x + (MIDDLE + 0.5f) - layers.pivot_x), layers)
#elif READS == 1
#define FIND_SPOT(instant, n) spot_in_row(row_spots[(instant) * LAYERS + n])
#else
#define FIND_SPOT(instant, n) spots[(instant) * LAYERS + n]
#endif

// Dimension 0: spans of a row's set of columns; 1: rows, each as STEP sets of columns.
kernel void swept_layers(global const float *restrict layer_0, global const float *restrict layer_1, global const float *restrict layer_2,
                         global const float *restrict layer_3, global const struct spot *restrict spots,
                         global const struct row_spot *restrict row_spots, global const struct view *restrict views, global const struct row_place *restrict places, global const float *restrict weights,
                         global float *restrict mosaic, const struct layers layers) {
    global const float *const planes[4] = {layer_0, layer_1, layer_2, layer_3};
    const size_t own_row = get_global_id(1) / STEP, row = layers.first_row + own_row;
    const size_t line = (layers.lines > 1 ? (own_row + layers.above) / layers.rows : 0) * layers.instants;
    const int begin = layers.first_column + (int)(STEP * get_global_id(0) * SPAN + get_global_id(1) % STEP);
    const uint colour = STEP == 1 ? layers.colour : cfa_plane((uint)begin, (uint)row);
    const int x = layers.origin_x + begin, y = layers.origin_y + (int)row;
    const struct row_place place = places[EDGES ? 0 : own_row];
    float sum[SPAN], passed[SPAN];
    for (uint i = 0; i < SPAN; i++) sum[i] = passed[i] = 0.0f;
    for (uint k = 0; k < layers.instants; k++) {
        struct spot own[LAYERS];
        for (uint n = 0; n < LAYERS; n++) own[n] = FIND_SPOT(line + k, n);
        const float weight = weights[line + k];
        if (is_inside(own, 0, MOVING, x, layers)) add_layers(planes, own, 0, MOVING, colour, x, y, 0, weight, 0, sum, MOVING < LAYERS ? passed : 0, place, layers);
        else add_layers(planes, own, 0, MOVING, colour, x, y, 1, weight, 0, sum, MOVING < LAYERS ? passed : 0, place, layers);
    }
#if MOVING < LAYERS
    struct spot own[LAYERS];
    for (uint n = 0; n < LAYERS; n++) own[n] = FIND_SPOT(line, n);
    if (is_inside(own, MOVING, LAYERS, x, layers)) add_layers(planes, own, MOVING, LAYERS, colour, x, y, 0, 0.0f, passed, sum, 0, place, layers);
    else add_layers(planes, own, MOVING, LAYERS, colour, x, y, 1, 0.0f, passed, sum, 0, place, layers);
#endif
    for (uint i = 0; i < SPAN; i++) {
        const uint column = (uint)(begin + (int)(STEP * i)); // wraps to a large number left of the frame
        if (column < layers.width) mosaic[(layers.mosaic_row + row) * layers.width + column] = sum[i];
    }
}
