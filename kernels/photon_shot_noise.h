// Photon shot noise: mean electrons [e-] -> counted electrons [e-], Poisson.
// normal: N(0, 1); word: 32 random bits; which of them counts depends on the mean (poisson.h).
// The host defines POISSON_VARIANT: what means the launch has.
#ifndef PHOTON_SHOT_NOISE_H
#define PHOTON_SHOT_NOISE_H
#include "poisson.h"

INLINE float photon_shot_noise(const float mean_e, const float normal, const uint word) { return poisson(mean_e, normal, word, POISSON_VARIANT); }

#endif
