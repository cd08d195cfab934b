// Spectral integration: the scene's planes, weighted by what the camera makes of each plane's spectrum.
//
// scene:   (height * width, BANDS) float32, dimensionless plane weights.
// weights: (BANDS, CHANNELS) float32 [e- s^-1 um^-2 sr^-1], integral of spectrum * lambda/(hc) * quantum efficiency.
// planes:  (CHANNELS, height * width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// One work-item per pixel (dimension 0) and channel (dimension 1).
#include "conventions.h"

kernel void camera_planes(global const float *restrict scene, global const float *restrict weights, global float *restrict planes) {
    const size_t pixel = get_global_id(0), channel = get_global_id(1);
    float sum = 0.0f;
    __attribute__((opencl_unroll_hint(8)))
    for (uint band = 0; band < BANDS; band++) sum += scene[pixel * BANDS + band] * weights[band * CHANNELS + channel];
    planes[channel * get_global_size(0) + pixel] = sum;
}
