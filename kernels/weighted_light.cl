// Sum of images at several instants, each weighted by the light that a line of the sensor gets there, or through spots of a filter.
//
// light:   (rows, width) float32, one image, of some rows of the frame [e- s^-1 um^-2 sr^-1].
// sum:     (frame rows, width) float32, weighted sum of images, added to.
// weights: (lines) float32, share of each line's light, of the frame's rows, or of its columns where COLUMNS is 1.
// first_row: of `light` in the frame. Dimension 0: columns; 1: rows of `light`.
#include "conventions.h"

kernel void weighted_light(global const float *restrict light, global float *restrict sum, global const float *restrict weights,
                           const uint first_row) {
    const size_t column = get_global_id(0), row = first_row + get_global_id(1), width = get_global_size(0);
    sum[row * width + column] += weights[COLUMNS ? column : row] * light[get_global_id(1) * width + column];
}
