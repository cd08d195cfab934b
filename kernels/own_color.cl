// The light of one colour goes to the photosites of that colour, of a colour filter pattern of any size (cfa.h).
//
// light: (height, width) float32, electron radiance [e- s^-1 um^-2 sr^-1] of a sensor whose photosites all have colour plane `channel`.
// mosaic: (height, width) float32, likewise; written at the photosites of this colour. One work-item per photosite.
#include "cfa.h"

kernel void own_color(global const float *restrict light, global float *restrict mosaic, const uint channel) {
    const size_t column = get_global_id(0), row = get_global_id(1), index = row * get_global_size(0) + column;
    if (cfa_plane((uint)column, (uint)row) == channel) mosaic[index] = light[index];
}
