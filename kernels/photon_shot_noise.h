// Photon shot noise: mean electrons [e-] -> counted electrons [e-], Poisson.
#ifndef PHOTON_SHOT_NOISE_H
#define PHOTON_SHOT_NOISE_H
#include "conventions.h"
#include "poisson.h"

INLINE float photon_shot_noise(const float mean_e, const struct words random) { return poisson(mean_e, random.a, random.b); }

#endif
