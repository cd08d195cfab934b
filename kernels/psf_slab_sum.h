// What a photosite gathers from the surfaces around it through the kernels of one slab (kernels/psf_slabs.cl).
#ifndef PSF_SLAB_SUM_H
#define PSF_SLAB_SUM_H
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "psf_slabs.h"

// Adds to a span's sums what a row of taps gathers. light: (2, WIDE) even and odd columns of samples, from column FIRST on.
INLINE void add_taps(const float *weight, const float *light, const size_t parity, float *sum) {
    LANES
    for (uint i = 0; i < SPAN; i++) {
        float part = 0.0f;
        __attribute__((opencl_unroll_hint(TAPS)))
        for (uint t = 0; t < TAPS; t++) {
            const int sample = (int)(parity + t) - TAPS / 2;
            part += weight[t] * light[column_set(sample) * WIDE + column_in_set(sample) - FIRST + i];
        }
        sum[i] += part;
    }
}

// Sums of light and of coverage over the taps of one slab and of its columns of nodes: (NODE_SPAN, SPAN). from, cover, far: colour, coverage and
// place at the span's first column of even photosites. set_step: elements to that of odd ones.
INLINE void sum_slab(global const float *from, global const float *cover, global const float *far,
                     global const float *of_slab, const struct slab_term term, const size_t set_step, const size_t columns,
                     const size_t parity, const size_t pair_step, const size_t below, const size_t halves, const float share,
                     const float limit, float *sum, float *seen) {
    for (int j = 0; j < TAPS; j++) {
        float lit[2 * WIDE], held[2 * WIDE], above[BRIGHT ? 2 * WIDE : 1];
        uint any = 0, high = 0;
        for (uint set = 0; set < 2; set++) {
            const long start = (long)(set * set_step) + (j - TAPS / 2) * (long)columns + FIRST;
            for (uint k = 0; k < WIDE; k++) {
                const float own = slab_share(term, far[start + k]), value = from[start + k], dim = BRIGHT && value > limit ? limit : value;
                lit[set * WIDE + k] = own * dim;
                if (BRIGHT) above[set * WIDE + k] = own * (value - dim);
                held[set * WIDE + k] = COVERAGE ? own * cover[start + k] : own;
                any |= own != 0.0f;
                high |= BRIGHT && value > limit;
            }
        }
        if (!any) continue; // no photosite of the row is of this slab
        for (uint c = 0; c < term.columns; c++) {
            float weight[TAPS], excess[BRIGHT ? TAPS : 1];
            mix_taps(TAPS, of_slab + c * pair_step + j * TAPS, below, halves, share, weight, excess);
            add_taps(weight, lit, parity, sum + c * SPAN);
            add_taps(weight, held, parity, seen + c * SPAN);
            if (BRIGHT && high) add_taps(excess, above, parity, sum + c * SPAN);
        }
    }
}

#endif
