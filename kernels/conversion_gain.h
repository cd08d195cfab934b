// Conversion gain: electrons [e-] -> signal of the pixel's amplifier, as electrons at low conversion gain [e-].
#ifndef CONVERSION_GAIN_H
#define CONVERSION_GAIN_H
#include "conventions.h"

INLINE float conversion_gain(const float electrons, constant float *parameters) { return electrons * CONVERSION_GAIN_RATIO; }

#endif
