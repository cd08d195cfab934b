// Spectral integration: the scene's planes, weighted by what the camera makes of each plane's spectrum, for a part of the scene.
//
// scene:   (part rows, scene width, BANDS) float32, dimensionless plane weights, of the part's rows alone.
// weights: [e- s^-1 um^-2 sr^-1], integral of spectrum * lambda/(hc) * quantum efficiency, float32: (BANDS, CHANNELS) of fewer than 8
//          bands, else (eights, CHANNELS, 8), where the last eight bands are BANDS - 8 and on and have 0 where others have counted them.
// planes:  (CHANNELS, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1]; written in the part alone.
// width, pixels: scene width, and pixels of the whole scene. first_column, first_row: of the part in the scene.
// eights: number of eights of bands, an argument so that no compiler unrolls their loop and mixes pixels.
// One work-item per column (dimension 0) and row (1) of the part and channel (2); of 8 bands and more, for all channels.
#include "conventions.h"

// Asks for one vector of as many floats as the loop that follows has steps.
#define EIGHT _Pragma("clang loop vectorize_width(8) interleave_count(1)")
#define FOUR _Pragma("clang loop vectorize_width(4) interleave_count(1)")

kernel void camera_planes(global const float *restrict scene, global const float *restrict weights, global float *restrict planes,
                          const uint width, const ulong pixels, const uint first_column, const uint first_row, const uint eights) {
    const size_t column = first_column + get_global_id(0), row = get_global_id(1);
    const size_t pixel = row * width + column, place = first_row * (size_t)width + pixel;
    global const float *restrict own = scene + pixel * BANDS;
#if BANDS < 8 // vectorised across pixels
    const size_t channel = get_global_id(2);
    float sum = 0.0f;
    __attribute__((opencl_unroll_hint(8)))
    for (uint band = 0; band < BANDS; band++) sum += own[band] * weights[band * CHANNELS + channel];
    planes[channel * pixels + place] = sum;
#else // within a pixel, whose bands lie side by side
    float sums[CHANNELS][8];
    for (uint channel = 0; channel < CHANNELS; channel++) {
        EIGHT
        for (uint i = 0; i < 8; i++) sums[channel][i] = 0.0f;
    }
    for (uint eight = 0; eight < eights; eight++) {
        const uint band = eight + 1 < eights ? 8 * eight : BANDS - 8;
        for (uint channel = 0; channel < CHANNELS; channel++) {
            EIGHT
            for (uint i = 0; i < 8; i++) sums[channel][i] += own[band + i] * weights[(eight * CHANNELS + channel) * 8 + i];
        }
    }
    for (uint channel = 0; channel < CHANNELS; channel++) {
        float four[4];
        FOUR
        for (uint i = 0; i < 4; i++) four[i] = sums[channel][i] + sums[channel][i + 4];
        planes[channel * pixels + place] = (four[0] + four[2]) + (four[1] + four[3]);
    }
#endif
}
