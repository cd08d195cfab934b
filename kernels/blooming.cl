// Blooming: charge above the full well leaves a photosite in equal packets, up and down, with SIDES 4 also left and right. A packet travels
// one photosite a step in its direction; wherever it arrives it fills what room the well has, packets that arrive together by their
// size, and the rest travels on. A packet that leaves the frame is lost, as what travels after the last step is.
//
// charge: (height, width) float32 [e-], changed in place. capacity_e: full well [e-].
// packets, arriving: (SIDES, height, width) float32 [e-], charge that leaves each photosite up, down, left, right; before and after a step.
// One work-item per photosite.
#include "conventions.h"

// Element of a packet that moves on in direction `side` and arrives at (x, y), or -1 where it would come from outside.
INLINE long origin(const uint side, const long x, const long y, const long width, const long height) {
    const long from_x = side == 2u ? x + 1 : (side == 3u ? x - 1 : x), from_y = side == 0u ? y + 1 : (side == 1u ? y - 1 : y);
    const int inside = from_x >= 0 && from_x < width && from_y >= 0 && from_y < height;
    return inside ? ((long)side * height + from_y) * width + from_x : -1;
}

kernel void blooming_start(global float *restrict charge, global float *restrict packets, const float capacity_e) {
    const size_t size = get_global_size(0) * get_global_size(1), index = get_global_id(1) * get_global_size(0) + get_global_id(0);
    const float held = charge[index], excess = held > capacity_e ? held - capacity_e : 0.0f;
    for (uint side = 0; side < SIDES; side++) packets[side * size + index] = excess * (1.0f / SIDES);
    charge[index] = held > capacity_e ? capacity_e : held;
}

kernel void blooming_step(global float *restrict charge, global const float *restrict packets, global float *restrict arriving,
                          const float capacity_e) {
    const long width = (long)get_global_size(0), height = (long)get_global_size(1), x = (long)get_global_id(0), y = (long)get_global_id(1);
    const long size = width * height, index = y * width + x;
    float packet[SIDES], sum = 0.0f;
    for (uint side = 0; side < SIDES; side++) {
        const long from = origin(side, x, y, width, height);
        packet[side] = from < 0 ? 0.0f : packets[from];
        sum += packet[side];
    }
    const float held = charge[index], room = capacity_e - held, left = sum > room ? (sum - room) / sum : 0.0f;
    for (uint side = 0; side < SIDES; side++) arriving[side * size + index] = packet[side] * left;
    if (sum > 0.0f) charge[index] = sum > room ? capacity_e : held + sum;
}
