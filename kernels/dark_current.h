// Dark current: electrons [e-] -> electrons + Poisson(mean) [e-]. normal: N(0, 1); word: 32 random bits (poisson.h).
// The mean is the same for all photosites, so the host chooses the Poisson code (VARIANT) and gives ROOT = 1 / sqrt(mean).
#ifndef DARK_CURRENT_H
#define DARK_CURRENT_H
#include "poisson.h"

INLINE float dark_current(const float electrons, const float normal, const uint word, constant float *parameters) {
#if DARK_CURRENT_VARIANT == LARGE_MEANS || DARK_CURRENT_VARIANT == BRIGHT_MEANS
    const float dark_e = poisson_expansion(DARK_CURRENT_MEAN_E, DARK_CURRENT_ROOT, normal, DARK_CURRENT_VARIANT);
#else
    const float share = fine_uniform(word ^ (zero_after(electrons) << 16));
    const float dark_e = poisson_inversion(DARK_CURRENT_MEAN_E, share, DARK_CURRENT_VARIANT);
#endif
    return electrons + apart(dark_e);
}

#endif
