// Poisson numbers of any mean.
// From POISSON_SWITCH e- up: floor of an expansion of the inverse distribution function in a normal number. Orders up to
// 1/sqrt(mean) are Giles' Q2 (2016, ACM TOMS 42:1, algorithm 955); the rest, two polynomials in s = w / sqrt(mean) as his uniform
// expansion has them and one for the order 1/mean, was fitted here to the exact quantiles for means of 5 to 260. The probability
// beyond any count is right to 1.5e-5, in the tails to 2 % of itself and 1e-8. From POISSON_BRIGHT e- up Q2 does.
// Below POISSON_SWITCH: inversion with a fixed trip count, right to 1e-9 of probability in the upper tail.
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
#define NEEDS_NORMAL(means) ((means) <= ALL_MEANS || (means) == BRIGHT_MEANS)

// r: 1 / sqrt(mean). w: N(0, 1). The fit holds for s from -1.3 up; below, the count is 0 with s = -1.3, too.
INLINE float poisson_expansion(const float mean, const float r, const float w, const int means) {
    const float w2 = w * w;
    float higher = 0.0f;
    if (means != BRIGHT_MEANS) {
        const float s = larger(w * r, -1.3f);
        const float order5 = 2.2817263e-03f - w2 * 3.1632485e-04f;
        const float order4 = w2 * 1.0883326e-03f + (s * order5 - 4.5177982e-03f);
        const float order3 = s * order4 - (1.3838127e-03f + w2 * 1.8000387e-03f);
        const float order2 = (w2 * 3.9402716e-03f + 7.514424e-03f) + s * order3;
        const float d = -2.0080567e-02f + s * 1.7190101e-02f;
        higher = mean < POISSON_BRIGHT ? s * s * order2 + r * r * d : 0.0f;
    }
    const float order1 = w * ((-1.0f / 36.0f) - w2 * (1.0f / 72.0f));
    const float q = mean + (mean * r * w + ((1.0f / 3.0f) + w2 * (1.0f / 6.0f) + (r * order1 + higher)));
    const float count = means != BRIGHT_MEANS ? larger(0.0f, q) : q; // of bright means above 0 at the farthest normal number
    return q < 8388608.0f ? (float)(int)count : q; // from 2^23 up a float is whole
}

// Number of k with share < P(X > k), share uniform in (0, 1]; both sides are multiplied by e^mean. P(X > k) is summed from its end, so
// that it keeps its digits where it is small. Written out to be vectorised across photosites, powers by squares, so that none waits
// for long. Terms mean^k / k! that are left out add up to less than the least share, 2.3e-10.
INLINE float poisson_inversion(const float mean, const float share, const int means) {
    const float limit = share * exponential(mean);
    const float m2 = mean * mean, m3 = m2 * mean, m4 = m2 * m2, m5 = m4 * mean, m6 = m4 * m2, m7 = m4 * m3, m8 = m4 * m4;
    float beyond = 0.0f, count = 0.0f;
#define TERM(power) beyond = beyond + (power); count += limit < beyond ? 1.0f : 0.0f;
    if (means != SMALLEST_MEANS) {
        if (means != SMALLER_MEANS) {
            const float m16 = m8 * m8;
            TERM(m16 * (m8 * 1.611737591e-24f)) TERM(m16 * (m7 * 3.868170298e-23f))
            TERM(m16 * (m6 * 8.896790960e-22f)) TERM(m16 * (m5 * 1.957294152e-20f))
            TERM(m16 * (m4 * 4.110317591e-19f)) TERM(m16 * (m3 * 8.220635078e-18f))
            TERM(m16 * (m2 * 1.561920681e-16f)) TERM(m16 * (mean * 2.811457359e-15f))
            beyond = mean < 2.0f ? 0.0f : beyond; // as in the variant for smaller means
        }
        TERM(m8 * (m8 * 4.779477256e-14f)) TERM(m8 * (m7 * 7.647163610e-13f))
        TERM(m8 * (m6 * 1.147074536e-11f)) TERM(m8 * (m5 * 1.605904437e-10f))
        TERM(m8 * (m4 * 2.087675588e-09f)) TERM(m8 * (m3 * 2.505210794e-08f))
        TERM(m8 * (m2 * 2.755731998e-07f))
        beyond = mean < 0.5f ? 0.0f : beyond;
    }
    TERM(m8 * (mean * 2.755731884e-06f)) TERM(m8 * 2.480158764e-05f)
    TERM(m7 * 1.984127011e-04f) TERM(m6 * 1.388888923e-03f)
    TERM(m5 * 8.333333768e-03f) TERM(m4 * 4.166666791e-02f)
    TERM(m3 * 1.666666716e-01f) TERM(m2 * 5.000000000e-01f)
    TERM(mean * 1.000000000e+00f)
#undef TERM
    return count;
}

// mean: >= 0 [e-]. normal: N(0, 1), for large means. word: 32 random bits, for small ones. Returns a count [e-].
INLINE float poisson(const float mean, const float normal, const uint word, const int means) {
    const float share = fine_uniform(word);
    if (means == LARGE_MEANS || means == BRIGHT_MEANS) return poisson_expansion(mean, reciprocal_square_root(mean), normal, means);
    if (means != ALL_MEANS) return poisson_inversion(mean, share, means);
    const float bright = larger(mean, POISSON_SWITCH);
    const float large = poisson_expansion(bright, reciprocal_square_root(bright), normal, means);
    const float small = poisson_inversion(smaller(mean, POISSON_SWITCH), share, means);
    return mean < POISSON_SWITCH ? small : large;
}

#endif
