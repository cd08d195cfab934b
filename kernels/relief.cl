// What each patch of a map holds: least and greatest value, the greatest step between neighbours, the mean slope, and which
// classes of values occur, so that the planner knows where a surface is smooth and how it tilts.
//
// map:    (planes, rows, way_columns) float32, split by column parity as in defocus.cl; this one's two planes begin at first_plane.
// relief: (5, rows / PATCH_ROWS, way_columns / HALF_PATCH) float32: least, greatest, greatest step to the right or below, mean
//         slope to the right and down.
// present: (2, rows / PATCH_ROWS, way_columns / HALF_PATCH) uint32, a bit for each class of values, from `first_class` on:
//          classes_per_unit * asinh(value / CLASS_UNIT), so that they widen with the value.
// One work-item per patch of HALF_PATCH half columns (dimension 0) and PATCH_ROWS rows (dimension 1).
#include "conventions.h"
#include "plain_math.h"

INLINE int class_of(const float value, const float first_class, const float classes_per_unit) {
    const float size = (value < 0.0f ? -value : value) * (1.0f / CLASS_UNIT), square = size * size + 1.0f;
    const float place = classes_per_unit * natural_log(size + square * reciprocal_square_root(square));
    return (int)((value < 0.0f ? -place : place) - first_class);
}

INLINE float step_between(const float a, const float b) { return a > b ? a - b : b - a; }

kernel void relief(global const float *restrict map, global float *restrict relief, global uint *restrict present, const uint rows,
                   const uint way_columns, const uint first_plane, const float first_class, const float classes_per_unit) {
    const size_t tile = get_global_id(1) * get_global_size(0) + get_global_id(0), tiles = get_global_size(0) * get_global_size(1);
    const size_t column = get_global_id(0) * HALF_PATCH;
    const uint top = get_global_id(1) * PATCH_ROWS, reach = way_columns - column < HALF_PATCH + 1 ? 0u : 1u;
    global const float *even = map + (size_t)first_plane * rows * way_columns + column, *odd = even + (size_t)rows * way_columns;
    float low[HALF_PATCH], high[HALF_PATCH], steep[HALF_PATCH];
    float down_all[HALF_PATCH], across_all = 0.0f;
    uint near[HALF_PATCH], far[HALF_PATCH];
    for (uint i = 0; i < HALF_PATCH; i++) {
        const size_t last = (size_t)(top + PATCH_ROWS - 1) * way_columns + i, first = (size_t)top * way_columns + i;
        down_all[i] = even[last] - even[first] + (odd[last] - odd[first]);
        low[i] = high[i] = even[(size_t)top * way_columns + i];
        steep[i] = 0.0f;
        near[i] = far[i] = 0u;
    }
    for (uint row = top; row < top + PATCH_ROWS; row++) {
        global const float *a = even + (size_t)row * way_columns, *b = odd + (size_t)row * way_columns;
        const size_t down = row + 1 < rows ? way_columns : 0;
        across_all += b[HALF_PATCH - 1] - a[0];
        for (uint i = 0; i < HALF_PATCH; i++) {
            const float p = a[i], q = b[i];
            low[i] = smaller(low[i], smaller(p, q));
            high[i] = larger(high[i], larger(p, q));
            const float across = larger(step_between(p, q), step_between(q, a[i + reach]));
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
    relief[tile] = low[0];
    relief[tiles + tile] = high[0];
    relief[2 * tiles + tile] = steep[0];
    relief[3 * tiles + tile] = across_all * (1.0f / (PATCH_ROWS * (2 * HALF_PATCH - 1)));
    relief[4 * tiles + tile] = down_all[0] * (1.0f / (2 * HALF_PATCH * (PATCH_ROWS - 1)));
    present[tile] = near[0];
    present[tiles + tile] = far[0];
}
