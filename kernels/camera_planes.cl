// Spectral integration: the scene's planes, weighted by what the camera makes of each plane's spectrum, for a part of the scene.
//
// scene:   (part rows, scene width, BANDS) float32, dimensionless plane weights, of the part's rows alone.
// weights: (BANDS, CHANNELS) float32 [e- s^-1 um^-2 sr^-1], integral of spectrum * lambda/(hc) * quantum efficiency.
// planes:  (CHANNELS, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1]; written in the part alone.
// width, pixels: scene width, and pixels of the whole scene. first_column, first_row: of the part in the scene.
// One work-item per column (dimension 0) and row (1) of the part and channel (2).
#include "conventions.h"

kernel void camera_planes(global const float *restrict scene, global const float *restrict weights, global float *restrict planes,
                          const uint width, const ulong pixels, const uint first_column, const uint first_row) {
    const size_t column = first_column + get_global_id(0), row = get_global_id(1), channel = get_global_id(2);
    const size_t pixel = row * width + column;
    float sum = 0.0f;
    __attribute__((opencl_unroll_hint(8)))
    for (uint band = 0; band < BANDS; band++) sum += scene[pixel * BANDS + band] * weights[band * CHANNELS + channel];
    planes[channel * pixels + first_row * (size_t)width + pixel] = sum;
}
