// Binning: FACTOR x FACTOR photosites of one colour are combined into one. The host defines FACTOR, and STEP, the distance of
// photosites of one colour: 2 with a colour filter array, whose pattern is preserved; 1 without.
//
// electrons: (height, width) float32 [e-], binned_electrons: (height / FACTOR, width / FACTOR) float32, their sums.
// codes: (height, width) uint16 [DN], binned_codes: (height / FACTOR, width / FACTOR) uint16, their rounded means.
// width: of the unbinned frame [px]. One work-item per binned photosite.
#include "plain_math.h"

// First row (or column) of the unbinned frame that contributes to this row (or column) of the binned one.
INLINE size_t first_of(const size_t position) { return (position / STEP) * (FACTOR * STEP) + position % STEP; }

kernel void bin_electrons(global const float *restrict electrons, global float *restrict binned_electrons, const uint width) {
    const size_t column = get_global_id(0), row = get_global_id(1), corner = first_of(row) * width + first_of(column);
    float sum = 0.0f;
    for (uint y = 0; y < FACTOR; y++)
        for (uint x = 0; x < FACTOR; x++) sum += electrons[corner + (size_t)(y * STEP) * width + x * STEP];
    binned_electrons[row * get_global_size(0) + column] = sum;
}

kernel void bin_codes(global const ushort *restrict codes, global ushort *restrict binned_codes, const uint width) {
    const size_t column = get_global_id(0), row = get_global_id(1), corner = first_of(row) * width + first_of(column);
    float sum = 0.0f;
    for (uint y = 0; y < FACTOR; y++)
        for (uint x = 0; x < FACTOR; x++) sum += (float)codes[corner + (size_t)(y * STEP) * width + x * STEP];
    binned_codes[row * get_global_size(0) + column] = (ushort)nearest(sum * (1.0f / (float)(FACTOR * FACTOR)));
}
