// Hot pixels: electrons [e-] -> electrons + Poisson(mean of this photosite) [e-] in a share of the photosites.
// That mean belongs to the body, exponentially distributed around MEAN_E. normal: N(0, 1); bits: see random_numbers.h.
#ifndef HOT_PIXELS_H
#define HOT_PIXELS_H
#include "random_numbers.h"
#include "poisson.h"

INLINE float hot_pixels(const float electrons, const float normal, const uint *bits, constant float *parameters) {
    const uint later = zero_after(electrons) << 16; // << 16: fine_uniform drops the lowest bit; see zero_after
    const float mean_e = HOT_PIXELS_MEAN_E * exponential_variate(bits[HOT_MEAN] ^ later);
    const float dark_e = poisson(mean_e, normal, bits[HOT_COUNT] ^ (zero_after(mean_e) << 16), ALL_MEANS);
    return electrons + apart(uniform(bits[HOT_SHARE]) < HOT_PIXELS_SHARE ? dark_e : 0.0f);
}

#endif
