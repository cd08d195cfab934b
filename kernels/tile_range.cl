// Least and greatest value in each column of each tile row, from which the host chooses the Poisson code of each tile.
//
// image: (height, width) float32. edges: (tile_rows + 1,) uint32, first row of each tile row and, last, the height; at most
// TILE_HEIGHT rows each. range: (2, tile_rows, width) float32, least and greatest.
// One work-group per SEGMENT columns (dimension 0) and tile row (dimension 1). On a CPU one work-item runs along them (WORK_ITEMS
// is 1), on a GPU each takes a column. The trip count over rows is constant so that the loop can be unrolled: shorter tile rows
// read their last row again.
#include "plain_math.h"

kernel void tile_range(global const float *restrict image, global float *restrict range, global const uint *restrict edges,
                       const uint width) {
    const size_t tile = get_global_id(1), left = get_group_id(0) * SEGMENT;
    const size_t right = left + SEGMENT < width ? left + SEGMENT : width;
    const size_t first = edges[tile], last = edges[tile + 1] - 1;
    _Pragma("clang loop vectorize(assume_safety)")
    for (size_t column = left + get_local_id(0); column < right; column += WORK_ITEMS) {
        float least = image[first * width + column], greatest = least;
        __attribute__((opencl_unroll_hint(TILE_HEIGHT)))
        for (size_t step = 1; step < TILE_HEIGHT; step++) {
            const size_t row = first + step < last ? first + step : last;
            const float value = image[row * width + column];
            least = smaller(least, value);
            greatest = larger(greatest, value);
        }
        range[tile * width + column] = least;
        range[(get_global_size(1) + tile) * width + column] = greatest;
    }
}
