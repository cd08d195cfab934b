// Variance of charge after electrical crosstalk, summed over binned photosites: each photosite's own variance times the square of all of
// its charge that goes into the sum.
//
// variance: (height, width) float32, of the independent charges of photosites [e-^2]. mixed: (binned height, binned width) float32.
// shares: (16, TAPS, TAPS) float32, of the photosites around those that are summed, TAPS = STEP (FACTOR - 1) + 3; from which
//   on the frame ends above (1), below (2), to the left (4) and to the right (8) of them, and 0 for photosites beyond. They are taken twice,
//   since the square of a small one is below the range of single precision.
// FACTOR: binned photosites per side, 1: none. STEP: distance of photosites of one colour.
// One work-item per photosite of the binned frame.
#include "conventions.h"

#define TAPS (STEP * (FACTOR - 1) + 3)

kernel void crosstalk_variance(global const float *restrict variance, global float *restrict mixed, global const float *restrict shares,
                               const int width, const int height) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    const int first_x = x / STEP * (FACTOR * STEP) + x % STEP - 1, first_y = y / STEP * (FACTOR * STEP) + y % STEP - 1;
    const int vertical = (first_y < 0 ? 1 : 0) + (first_y + TAPS > height ? 2 : 0);
    const int edges = vertical + (first_x < 0 ? 4 : 0) + (first_x + TAPS > width ? 8 : 0);
    global const float *own = shares + edges * (TAPS * TAPS);
    float sum = 0.0f;
    for (int j = 0; j < TAPS; j++) {
        const int row = first_y + j, inside = row < 0 ? 0 : (row < height ? row : height - 1);
        for (int i = 0; i < TAPS; i++) {
            const int column = first_x + i, within = column < 0 ? 0 : (column < width ? column : width - 1);
            sum += own[j * TAPS + i] * (own[j * TAPS + i] * variance[(long)inside * width + within]);
        }
    }
    mixed[(long)y * (long)get_global_size(0) + x] = sum;
}
