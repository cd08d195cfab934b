// Light in full colour for kernels/psf_gather.cl, one sample per photosite in interleaved columns: from frames that are blurred
// already, and from the layers of a scene as if nothing were out of focus.
//
// planes: (CHANNELS, 2, rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1], a band with its margins.
#include "conventions.h"
#include "interleaved_columns.h"

// Writes blurred frames, mosaics: (colours, mosaic_rows, mosaic_columns) float32, from plane `first_color` on, into `planes`, with one sample
// per photosite; what lies beyond them stays as it is. shift_x, shift_y: photosite of the band at their upper left corner.
// Dimension 0: columns of a set; 1: rows; 2: column sets of all colours.
kernel void psf_interleave(global const float *restrict mosaics, global float *restrict planes, const uint first_color, const uint mosaic_columns,
                           const uint mosaic_rows, const int shift_x, const int shift_y) {
    const size_t set = get_global_id(2) % 2, number = get_global_id(2) / 2;
    const uint column = (uint)(2 * get_global_id(0) + set) - (uint)shift_x, row = (uint)get_global_id(1) - (uint)shift_y;
    if (column >= mosaic_columns || row >= mosaic_rows) return;
    planes[row_start(2 * (first_color + number) + set, get_global_id(1), get_global_size(1), get_global_size(0)) + get_global_id(0)] =
        mosaics[(number * mosaic_rows + row) * mosaic_columns + column];
}

// Sharp image of layers front to back: in place, planes of the first layer become the composite, the first map the blur radius of the
// surface that each photosite sees. Light and coverage are premultiplied; without coverage there is one layer.
// layers: (LAYERS, CHANNELS + 1, 2, rows, set_columns) float32. radius: (LAYERS, 2, rows, set_columns) float32 [photosites].
// Dimension 0: columns of a set; 1: rows; 2: column sets.
kernel void psf_composite(global float *restrict layers, global float *restrict radius) {
    const size_t columns = get_global_size(0), rows = get_global_size(1), plane = rows * columns;
    const size_t at = (get_global_id(2) * rows + get_global_id(1)) * columns + get_global_id(0);
    float open = 1.0f, seen = radius[at], light[CHANNELS];
    for (uint c = 0; c < CHANNELS; c++) light[c] = 0.0f;
    bool found = false;
    for (uint layer = 0; layer < LAYERS; layer++) {
        global const float *of_layer = layers + layer * (CHANNELS + 1) * 2 * plane + at;
        for (uint c = 0; c < CHANNELS; c++) light[c] += open * of_layer[2 * c * plane];
        open *= 1.0f - of_layer[2 * CHANNELS * plane];
        if (!found && open < 0.5f) {
            found = true;
            seen = radius[2 * layer * plane + at];
        }
    }
    const float covered = 1.0f - open, scale = OPAQUE && covered > 0.001f ? 1.0f / covered : 1.0f;
    for (uint c = 0; c < CHANNELS; c++) layers[2 * c * plane + at] = scale * light[c];
    radius[at] = seen;
}
