// Places in a scene in fixed point, so that one far from the corner is as exact as one near it.
#ifndef FIXED_PLACE_H
#define FIXED_PLACE_H
#include "conventions.h"
#include "plain_math.h"
#define PLACE_BITS 40 // of the fraction of a place in fixed point
#define WHOLE_BITS 14 // of the fraction of the whole part of a number in two parts

// A number in two parts [px]: `whole` 2^-WHOLE_BITS, and what is left. The product of the former with the number of a sample fits an int.
struct parted {
    int whole;
    float rest;
};

// A place along an axis of the scene: `past` right of where a pixel begins [px].
struct place {
    int pixel;
    float past;
};

INLINE long in_fixed_point(const float number, const float rest) {
    const float one = (float)(1L << PLACE_BITS);
    return (long)(number * one) + (long)(rest * one);
}

INLINE struct parted in_parts(const float number, const float rest) {
    const float one = (float)(1 << WHOLE_BITS);
    const int count = whole(number * one + 0.5f);
    const struct parted found = {count, (number - (float)count * (1.0f / one)) + rest};
    return found;
}

// How far right of where its pixel begins a place in fixed point lies [px], rounded down to 2^-23.
INLINE float rest_of(const long at) { return (float)(int)((at >> (PLACE_BITS - 23)) & 0x7FFFFF) * (1.0f / 8388608.0f); }

// Where a sample begins: its number on the sensor counts, so that a window anywhere has the same bits, and none is lost far out.
INLINE struct place sample_place(const long start, const long step, const int sample) {
    const long at = start + step * (long)sample;
    const struct place found = {(int)(at >> PLACE_BITS), rest_of(at)};
    return found;
}

// The same from numbers in two parts, `inset` right of where the sample begins [px].
INLINE struct place parted_place(const struct parted start, const struct parted step, const int sample, const float inset) {
    const int at = start.whole + step.whole * sample;
    const float past = (float)(at & ((1 << WHOLE_BITS) - 1)) * (1.0f / (1 << WHOLE_BITS));
    const struct place found = {at >> WHOLE_BITS, past + ((start.rest + step.rest * (float)sample) + inset)};
    return found;
}

// The place of a sample in fixed point, `inset` right of where it begins and displaced by `way` [photosites]: whole photosites of the
// way count as samples, so that what is rounded is less than two photosites.
INLINE void displaced_place(const long start, const long step, const int sample, const float scale, const float inset, const float way,
                            struct place *found) {
    const int photosites = whole(way);
    const long at = start + step * (long)(sample + OVER * photosites);
    const float past = rest_of(at) + scale * (inset + (way - (float)photosites));
    const int pixels = whole(past);
    found->pixel = (int)(at >> PLACE_BITS) + pixels;
    found->past = past - (float)pixels;
}

#endif
