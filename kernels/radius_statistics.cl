// Statistics of the blur radius in each patch of a map: range, steepest step, mean slope, and which classes of radii occur. The
// planner chooses the blur's method by them: how smooth a surface is, how it tilts, and which depths a patch holds.
//
// map:     (maps, COLUMN_SETS, rows, set_columns) float32, signed blur radius [photosites], in interleaved columns with OVER 1; map
//          number first_plane is measured.
// radius_statistics: (5, rows / PATCH_ROWS, set_columns / HALF_PATCH) float32: least, greatest [photosites]; greatest absolute difference to
//          the photosite on the right or below [photosites]; mean slope to the right, and down [photosites per photosite].
// present: (2, rows / PATCH_ROWS, set_columns / HALF_PATCH) uint32, 64 bits, one for each class of radii from first_class on, set
//          where the patch holds one (radius_class.h).
// Dimension 0: patches of HALF_PATCH columns of both sets; 1: patches of PATCH_ROWS rows.
#include "conventions.h"
#include "interleaved_columns.h"
#include "plain_math.h"
#include "radius_class.h"

// Absolute difference.
INLINE float step_between(const float a, const float b) { return a > b ? a - b : b - a; }

kernel void radius_statistics(global const float *restrict map, global float *restrict radius_statistics, global uint *restrict present, const uint rows,
                   const uint set_columns, const uint first_plane, const float first_class, const float classes_per_unit) {
    const size_t tile = get_global_id(1) * get_global_size(0) + get_global_id(0), tiles = get_global_size(0) * get_global_size(1);
    const size_t column = get_global_id(0) * HALF_PATCH;
    const uint top = get_global_id(1) * PATCH_ROWS, reach = set_columns - column < HALF_PATCH + 1 ? 0u : 1u;
    global const float *even = map + row_start(COLUMN_SETS * first_plane, 0, rows, set_columns) + column;
    global const float *odd = even + row_start(1, 0, rows, set_columns);
    float low[HALF_PATCH], high[HALF_PATCH], steep[HALF_PATCH];
    float down_all[HALF_PATCH], across_all = 0.0f;
    uint near[HALF_PATCH], far[HALF_PATCH];
    for (uint i = 0; i < HALF_PATCH; i++) {
        const size_t last = (size_t)(top + PATCH_ROWS - 1) * set_columns + i, first = (size_t)top * set_columns + i;
        down_all[i] = even[last] - even[first] + (odd[last] - odd[first]);
        low[i] = high[i] = even[(size_t)top * set_columns + i];
        steep[i] = 0.0f;
        near[i] = far[i] = 0u;
    }
    for (uint row = top; row < top + PATCH_ROWS; row++) {
        global const float *a = even + (size_t)row * set_columns, *b = odd + (size_t)row * set_columns;
        const size_t down = row + 1 < rows ? set_columns : 0;
        across_all += b[HALF_PATCH - 1] - a[0];
        for (uint i = 0; i < HALF_PATCH; i++) {
            const float p = a[i], q = b[i];
            low[i] = smaller(low[i], smaller(p, q));
            high[i] = larger(high[i], larger(p, q));
            const float across = larger(step_between(p, q), step_between(q, a[i + (i + 1 < HALF_PATCH ? 1u : reach)]));
            steep[i] = larger(steep[i], larger(across, larger(step_between(p, a[i + down]), step_between(q, b[i + down]))));
            const int first = class_of(p, first_class, classes_per_unit), second = class_of(q, first_class, classes_per_unit);
            near[i] |= (first < 32 ? 1u << (first & 31) : 0u) | (second < 32 ? 1u << (second & 31) : 0u);
            far[i] |= (first < 32 ? 0u : 1u << (first & 31)) | (second < 32 ? 0u : 1u << (second & 31));
        }
    }
    for (uint i = 1; i < HALF_PATCH; i++) {
        low[0] = smaller(low[0], low[i]);
        high[0] = larger(high[0], high[i]);
        steep[0] = larger(steep[0], steep[i]);
        down_all[0] += down_all[i];
        near[0] |= near[i];
        far[0] |= far[i];
    }
    radius_statistics[tile] = low[0];
    radius_statistics[tiles + tile] = high[0];
    radius_statistics[2 * tiles + tile] = steep[0];
    radius_statistics[3 * tiles + tile] = across_all * (1.0f / (PATCH_ROWS * (2 * HALF_PATCH - 1)));
    radius_statistics[4 * tiles + tile] = down_all[0] * (1.0f / (2 * HALF_PATCH * (PATCH_ROWS - 1)));
    present[tile] = near[0];
    present[tiles + tile] = far[0];
}
