// Poisson numbers of any mean.
// From POISSON_SWITCH e- up: floor of an expansion of the inverse distribution function in a normal number. Orders up to
// 1/mean are Giles' Q3 (2016, ACM TOMS 42:1, algorithm 955); the next two were fitted here to the exact quantiles for means of
// 5 to 60. From POISSON_BRIGHT e- up his Q2 does. Total variation distance to the exact distribution stays below 7e-5, the
// variance within 7e-5.
// Below POISSON_SWITCH: inversion with a fixed trip count, exact to 1e-6 of probability at the upper end.
// The host defines POISSON_SWITCH and POISSON_BRIGHT. Code for small or for large means alone is faster, so each caller names the
// range of means that it needs. The number that is drawn does not depend on this choice.
#ifndef POISSON_H
#define POISSON_H
#include "normal.h"
#include "plain_math.h"
#include "uniform.h"

// Values of `means`, a compile-time constant: the range of means.
#define LARGE_MEANS 0    // all at least POISSON_SWITCH
#define ALL_MEANS 1
#define SMALL_MEANS 2    // all below POISSON_SWITCH
#define SMALLER_MEANS 3  // all below 2
#define SMALLEST_MEANS 4 // all below 0.5
#define BRIGHT_MEANS 5   // all at least POISSON_BRIGHT

// r: 1 / sqrt(mean). w: N(0, 1).
INLINE float poisson_expansion(const float mean, const float r, const float w, const int means) {
    const float w2 = w * w;
    float higher = 0.0f;
    if (means != BRIGHT_MEANS) {
        const float order4 = 1.4885807e-03f + w2 * (-1.9217951e-02f + w2 * (2.6605090e-03f + w2 * 5.6170318e-04f));
        const float order3 = w * (1.5595448e-02f + w2 * (3.5844250e-04f - w2 * 2.0270417e-03f)) + r * order4;
        const float order2 = (-8.0f / 405.0f) + w2 * ((7.0f / 810.0f) + w2 * (1.0f / 270.0f)) + r * order3;
        higher = mean < POISSON_BRIGHT ? r * order2 : 0.0f;
    }
    const float order1 = w * ((-1.0f / 36.0f) - w2 * (1.0f / 72.0f)) + higher;
    const float q = mean + (mean * r * w + ((1.0f / 3.0f) + w2 * (1.0f / 6.0f) + r * order1));
    const float whole = (float)(int)larger(0.0f, smaller(q, 8388608.0f));
    return q < 8388608.0f ? whole : q; // from 2^23 up a float is whole
}

// Smallest k with P(X <= k) >= u, written out to be vectorised across photosites. u stays 1e-6 below 1: sums of float32
// probabilities end up to 8e-7 below it. After the last step P(X > k) is below 1e-7: 7 at a mean of 0.5, 14 at 2, 21 at 5.
INLINE float poisson_inversion(const float mean, const float u, const int means) {
    float probability = exponential(-mean), below = probability, count = 0.0f;
#define STEP(k) count += u > below ? 1.0f : 0.0f; probability = probability * (mean * (1.0f / (k))); below = below + probability;
#define STEPS(k) STEP(k) STEP(k + 1) STEP(k + 2) STEP(k + 3) STEP(k + 4) STEP(k + 5) STEP(k + 6)
    STEPS(1)
    if (means != SMALLEST_MEANS) { STEPS(8) }
    if (means != SMALLEST_MEANS && means != SMALLER_MEANS) { STEPS(15) }
#undef STEPS
#undef STEP
    return count;
}

// mean: >= 0 [e-]. normal: N(0, 1), for large means. word: 32 random bits, for small ones. Returns a count [e-].
INLINE float poisson(const float mean, const float normal, const uint word, const int means) {
    const float u = smaller(uniform(word), 0.999999f);
    if (means == LARGE_MEANS || means == BRIGHT_MEANS) return poisson_expansion(mean, reciprocal_square_root(mean), normal, means);
    if (means != ALL_MEANS) return poisson_inversion(mean, u, means);
    const float bright = larger(mean, POISSON_SWITCH);
    const float large = poisson_expansion(bright, reciprocal_square_root(bright), normal, means);
    const float small = poisson_inversion(smaller(mean, POISSON_SWITCH), u, means);
    return mean < POISSON_SWITCH ? small : large;
}

#endif
