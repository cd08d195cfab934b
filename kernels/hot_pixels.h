// Hot pixels: electrons [e-] -> electrons + Poisson(mean of this photosite) [e-] in a share of the photosites.
// That mean belongs to the body, exponentially distributed around MEAN_E. normal: N(0, 1); bits: see random_numbers.h.
#ifndef HOT_PIXELS_H
#define HOT_PIXELS_H
#include "random_numbers.h"
#include "poisson.h"

INLINE uint is_hot(const uint word, constant float *parameters) { return uniform(word) < HOT_PIXELS_SHARE ? 1u : 0u; }

// Returns 0 where neither photosite of the pair of rows of (x, y) is hot, else 1.
INLINE uint hot_rows(const uint x, const uint y, const uint body_seed, constant float *parameters) {
    const struct words body = block_of(x, y, HOT_PIXELS_STREAM, body_seed, 1u);
    return is_hot(body.a, parameters) | is_hot(body.b, parameters);
}

INLINE float hot_pixels(const float electrons, const float normal, const uint *bits, constant float *parameters) {
    if (bits[HOT_HERE] == 0u) return electrons;
    const uint later = zero_after(electrons) << 16; // << 16: fine_uniform drops the lowest bit; see zero_after
    const float mean_e = HOT_PIXELS_MEAN_E * exponential_variate(bits[HOT_MEAN] ^ later);
    const float dark_e = poisson(mean_e, normal, bits[HOT_COUNT] ^ (zero_after(mean_e) << 16), ALL_MEANS);
    return electrons + apart(is_hot(bits[HOT_SHARE], parameters) ? dark_e : 0.0f);
}

#endif
