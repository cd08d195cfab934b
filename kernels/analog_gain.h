// Analog gain: electrons [e-] -> signal [DN].
#ifndef ANALOG_GAIN_H
#define ANALOG_GAIN_H
#include "conventions.h"

INLINE float analog_gain(const float electrons, constant float *parameters) { return electrons * ANALOG_GAIN_GAIN_DN_PER_E; }

#endif
