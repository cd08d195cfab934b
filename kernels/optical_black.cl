// Optical black: photosites covered by metal at the sensor's edge get no light. All later stages, such as dark current and read
// noise, act on them as on any other.
//
// mosaic: (height, width) float32, electron radiance; covered photosites are set to 0.
// window_x, window_y: the mosaic's upper left photosite on the sensor. left, top: first column and row of the active area;
// right, bottom: first column and row after it. One work-item per photosite.
#include "conventions.h"

kernel void optical_black(global float *restrict mosaic, const uint window_x, const uint window_y, const uint left,
                          const uint top, const uint right, const uint bottom) {
    const size_t column = get_global_id(0), row = get_global_id(1), width = get_global_size(0);
    const size_t x = column + window_x, y = row + window_y;
    if (x < left || x >= right || y < top || y >= bottom) mosaic[row * width + column] = 0.0f;
}
