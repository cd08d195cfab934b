// Optical black: photosites under the metal at the sensor's edge get no light; all that follows, dark current and read noise
// too, happens to them as to any other.
//
// mosaic: (height, width) float32, electron radiance; covered places become 0.
// window_x, window_y: the mosaic's upper left photosite on the sensor. left, top: first column and row that see light,
// right, bottom: the first behind them that do not. One work-item per photosite.
#include "conventions.h"

kernel void optical_black(global float *restrict mosaic, const uint window_x, const uint window_y, const uint left,
                          const uint top, const uint right, const uint bottom) {
    const size_t column = get_global_id(0), row = get_global_id(1), width = get_global_size(0);
    const size_t x = column + window_x, y = row + window_y;
    if (x < left || x >= right || y < top || y >= bottom) mosaic[row * width + column] = 0.0f;
}
