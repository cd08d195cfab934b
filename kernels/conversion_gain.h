// Conversion gain: electrons [e-] -> what the pixel's amplifier sees, in electrons of the low conversion gain.
#ifndef CONVERSION_GAIN_H
#define CONVERSION_GAIN_H
#include "conventions.h"

INLINE float conversion_gain(const float electrons, constant float *parameters) { return electrons * CONVERSION_GAIN_RATIO; }

#endif
