// Crosstalk: a share of the signal of each photosite goes to its eight neighbours. Optical crosstalk acts on the light, before
// shot noise; electrical crosstalk on the collected charge. Beyond the frame's edge the nearest photosite is repeated.
//
// input, mixed: (height, width) float32, electron radiance or electrons.
// side, corner: share that goes to each of the four direct and of the four diagonal neighbours.
// One work-item per photosite.
#include "conventions.h"

kernel void crosstalk(global const float *restrict input, global float *restrict mixed, const float side, const float corner) {
    const size_t x = get_global_id(0), y = get_global_id(1), width = get_global_size(0), height = get_global_size(1);
    const size_t left = x > 0 ? x - 1 : x, right = x + 1 < width ? x + 1 : x;
    const size_t here = y * width, above = y > 0 ? here - width : here, below = y + 1 < height ? here + width : here;
    const float beside = (input[here + left] + input[here + right]) + (input[above + x] + input[below + x]);
    const float diagonal = (input[above + left] + input[above + right]) + (input[below + left] + input[below + right]);
    const float own = input[here + x];
    mixed[here + x] = own + (side * (beside - 4.0f * own) + corner * (diagonal - 4.0f * own));
}
