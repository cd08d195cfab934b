// The blur radii at which small parts of a band have light, for the tiles of kernels/psf_slabs.cl.
//
// planes: as there; COVERAGE 0: not read. radius: (LAYERS, 2, rows, set_columns) float32, signed blur radius [photosites].
// radii_px: (radii) float32, ascending; light is counted at the two around its radius.
// slabs:  (LAYERS, rows / EXTREME_ROWS, set_columns) uint64, of EXTREME_ROWS rows of two photosites side by side: one bit for each of
//         the radii, and bit 63 where a layer does not cover all of them.
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"

// Radii that are not greater than each of SPAN blur radii: `above`.
INLINE void count_radii(global const float *radius, global const float *radii_px, const uint radii, uint *above) {
    for (uint i = 0; i < SPAN; i++) above[i] = 0;
    for (uint n = 0; n < radii; n++) {
        const float own = radii_px[n];
        LANES
        for (uint i = 0; i < SPAN; i++) above[i] += own <= radius[i] ? 1u : 0u;
    }
}

// Dimension 0: spans of columns of a set; 1: groups of rows; 2: layers.
kernel void psf_slab_bits(global const float *restrict planes, global const float *restrict radius, global const float *restrict radii_px,
                          global ulong *restrict slabs, const uint radii) {
    const size_t column = SPAN * get_global_id(0), row = get_global_id(1), layer = get_global_id(2), columns = SPAN * get_global_size(0);
    const size_t rows = EXTREME_ROWS * get_global_size(1);
    ulong found[SPAN];
    for (uint i = 0; i < SPAN; i++) found[i] = 0;
    for (uint set = 0; set < 2; set++)
        for (uint j = 0; j < EXTREME_ROWS; j++) {
            global const float *here = radius + row_start(2 * layer + set, EXTREME_ROWS * row + j, rows, columns) + column;
            global const float *cover = planes + COVERAGE * (row_start(2 * (layer * (CHANNELS + COVERAGE) + CHANNELS) + set, EXTREME_ROWS * row + j, rows, columns) + column);
            uint above[SPAN];
            count_radii(here, radii_px, radii, above);
            for (uint i = 0; i < SPAN; i++) {
                const uint low = above[i] > 0 ? above[i] - 1 : 0, high = above[i] < radii && radii_px[low] < here[i] ? above[i] : low;
                const float covered = COVERAGE ? cover[i] : 1.0f;
                found[i] |= (covered > 0.0f ? 1ul << low | 1ul << high : 0ul) | (covered < 1.0f ? 1ul << 63 : 0ul);
            }
        }
    for (uint i = 0; i < SPAN; i++) slabs[row_start(layer, row, get_global_size(1), columns) + column + i] = found[i];
}

// Turns blur radii into places between slabs, in place: the number of the slab below, and the part of the way to the next.
// radius: (any) float32, signed [photosites]. radii_px: (radii) float32, those of the slabs, ascending.
// Dimension 0: spans of `radius`.
kernel void psf_slab_places(global float *restrict radius, global const float *restrict radii_px, const uint radii) {
    global float *here = radius + SPAN * get_global_id(0);
    uint above[SPAN];
    count_radii(here, radii_px, radii, above);
    for (uint i = 0; i < SPAN; i++) {
        const uint low = above[i] > 0 ? (above[i] < radii ? above[i] - 1 : radii - 2) : 0;
        const float way = (here[i] - radii_px[low]) / (radii_px[low + 1] - radii_px[low]);
        here[i] = (float)low + (way < 0.0f ? 0.0f : way > 1.0f ? 1.0f : way);
    }
}
