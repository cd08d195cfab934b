// The blur radii at which small parts of a band have light, for the tiles of kernels/psf_slabs.cl.
//
// planes: as there; COVERAGE 0: not read. radius: (LAYERS, 2, rows, set_columns) float32, signed blur radius [photosites].
// radii_px: (radii) float32, ascending; light is counted at the two around its radius.
// slabs:  (LAYERS, rows / EXTREME_ROWS, set_columns) uint64, of EXTREME_ROWS rows of two photosites side by side: one bit for each of
//         the radii, and bit 63 where a layer does not cover all of them.
#include "conventions.h"
#include "interleaved_columns.h"

// Dimension 0: columns of a set; 1: groups of rows; 2: layers.
kernel void psf_slab_bits(global const float *restrict planes, global const float *restrict radius, global const float *restrict radii_px,
                          global ulong *restrict slabs, const uint radii) {
    const size_t column = get_global_id(0), row = get_global_id(1), layer = get_global_id(2), columns = get_global_size(0);
    const size_t rows = EXTREME_ROWS * get_global_size(1);
    ulong found = 0;
    for (uint set = 0; set < 2; set++)
        for (uint j = 0; j < EXTREME_ROWS; j++) {
            const float here = radius[row_start(2 * layer + set, EXTREME_ROWS * row + j, rows, columns) + column];
            const float cover = COVERAGE ? planes[row_start(2 * (layer * (CHANNELS + COVERAGE) + CHANNELS) + set, EXTREME_ROWS * row + j, rows, columns) + column] : 1.0f;
            uint above = 0; // radii that are not greater
            for (uint n = 0; n < radii; n++) above += radii_px[n] <= here ? 1u : 0u;
            const uint low = above > 0 ? above - 1 : 0, high = above < radii && radii_px[low] < here ? above : low;
            if (cover > 0.0f) found |= 1ul << low | 1ul << high;
            if (cover < 1.0f) found |= 1ul << 63;
        }
    slabs[row_start(layer, row, get_global_size(1), columns) + column] = found;
}

// Turns blur radii into places between slabs, in place: the number of the slab below, and the part of the way to the next.
// radius: (any) float32, signed [photosites]. radii_px: (radii) float32, those of the slabs, ascending.
// Dimension 0: elements of `radius`.
kernel void psf_slab_places(global float *restrict radius, global const float *restrict radii_px, const uint radii) {
    const float here = radius[get_global_id(0)];
    uint above = 0; // radii that are not greater
    for (uint n = 0; n < radii; n++) above += radii_px[n] <= here ? 1u : 0u;
    const uint low = above > 0 ? (above < radii ? above - 1 : radii - 2) : 0;
    const float way = (here - radii_px[low]) / (radii_px[low + 1] - radii_px[low]);
    radius[get_global_id(0)] = (float)low + (way < 0.0f ? 0.0f : way > 1.0f ? 1.0f : way);
}
