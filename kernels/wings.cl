// Wings of diffraction: light from beyond the kernels, smooth over cells of the sensor, where the image has lost its share of it.
//   light(x) = image_share * light(x) + veil(x), between the middles of cells bilinear
//
// mosaic: (height, width) float32, electron radiance [e- s^-1 um^-2 sr^-1] in the colour of each photosite, changed in place.
// veil: (channels, rows, columns) float32, the same from beyond, of cells; the first lies above and to the left of the sensor.
// image_share: (channels) float32, of the light that stays within the kernels. window_x, window_y: the mosaic's upper left photosite
// on the sensor. PER_CELL: cells per photosite along an axis, a power of two.
// One work-item per photosite.
#include "cfa.h"
#include "conventions.h"

kernel void wings(global float *restrict mosaic, global const float *restrict veil, constant float *restrict image_share, const int window_x,
                  const int window_y, const int rows, const int columns) {
    const size_t column = get_global_id(0), row = get_global_id(1), here = row * get_global_size(0) + column;
    const float x = 0.5f + PER_CELL * ((float)(window_x + (int)column) + 0.5f), y = 0.5f + PER_CELL * ((float)(window_y + (int)row) + 0.5f);
    const int left = clamp((int)floor(x), 0, columns - 2), top = clamp((int)floor(y), 0, rows - 2);
    const float across = clamp(x - (float)left, 0.0f, 1.0f), down = clamp(y - (float)top, 0.0f, 1.0f);
    const size_t colour = cfa_plane(column, row);
    global const float *upper = veil + (colour * (size_t)rows + (size_t)top) * (size_t)columns + left, *lower = upper + columns;
    const float above = upper[0] + across * (upper[1] - upper[0]), below = lower[0] + across * (lower[1] - lower[0]);
    mosaic[here] = image_share[colour] * mosaic[here] + (above + down * (below - above));
}
