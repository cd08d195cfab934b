// Veiling glare: light scattered in the lens lies evenly on the sensor, where the image has lost it. The fall-off of the
// irradiance comes later (irradiance.h), so the veil is divided by it here.
//
// mosaic: (height, width) float32, electron radiance [e- s^-1 um^-2 sr^-1] in the colour of each photosite, changed in place.
// veil: (channels) float32, electron irradiance of the scattered light [e- s^-1 um^-2].
// parameters: (numbers) float32 of the stage irradiance; least_open: below this irradiance per radiance [sr] the veil fades, too.
// window_x, window_y: the mosaic's upper left photosite on the sensor. image_share: of the light that is not scattered.
// One work-item per photosite.
#include "cfa.h"
#include "irradiance.h"

kernel void veiling_glare(global float *restrict mosaic, constant float *restrict veil, constant float *restrict parameters,
                          const uint window_x, const uint window_y, const float image_share, const float least_open) {
    const size_t column = get_global_id(0), row = get_global_id(1), here = row * get_global_size(0) + column;
    const float open = irradiance(1.0f, window_x + (uint)column, window_y + (uint)row, parameters);
    mosaic[here] = image_share * mosaic[here] + veil[cfa_plane(column, row)] * reciprocal(larger(open, least_open));
}
