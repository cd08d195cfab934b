// Photon shot noise: mean electrons [e-] -> counted electrons [e-], Poisson.
// normal: N(0, 1), used for large means; word: 32 random bits, used for small ones (poisson.h).
// The host defines POISSON_VARIANT: the range of means of the launch.
#ifndef PHOTON_SHOT_NOISE_H
#define PHOTON_SHOT_NOISE_H
#include "poisson.h"

INLINE float photon_shot_noise(const float mean_e, const float normal, const uint word) { return poisson(mean_e, normal, word, POISSON_VARIANT); }

#endif
