// Takes the light of lamps out of a scene, so that each can be drawn by itself behind the lens.
//
// planes: (CHANNELS, pixels) float32, electron radiance of the scene [e- s^-1 um^-2 sr^-1]. places: (lamps) uint32, their pixels.
// left:   (lamps, CHANNELS) float32, what they keep, the same unit. Dimension 0: lamps; 1: colours.
#include "conventions.h"

kernel void lamps(global float *restrict planes, global const uint *restrict places, global const float *restrict left,
                  const ulong pixels) {
    const size_t colour = get_global_id(1);
    planes[colour * pixels + places[get_global_id(0)]] = left[get_global_id(0) * CHANNELS + colour];
}
