// Light that a span of photosites reads through one row of taps (kernels/psf_gather.cl), read once for all taps of the row.
#ifndef PSF_ROW_H
#define PSF_ROW_H
#include "conventions.h"
#include "interleaved_columns.h"

#define LEFT ((TAPS_X / OVER / 2 + 1) / 2) // columns of a set left of the span, and as many right of it
#define WIDE (SPAN + 2 * LEFT)

// Element of the tables below at which the span's first photosite reads a column of samples, counted from its pair's first sample.
INLINE int place_in_row(const int sample) { return column_set(sample) * WIDE + column_in_set(sample) + LEFT; }

// Light up to the limit, and with BRIGHT 1 light beyond it: (COLUMN_SETS, WIDE), with FOLD_Y 1 of two rows together. from: one row at the
// span's first column of the first set. set_step: elements to the next set. mirror: elements to the other row. parity: of the span.
INLINE void read_row(global const float *from, const size_t set_step, const long mirror, const size_t parity, const float limit,
                     float *dim, float *above) {
    for (uint set = 0; set < COLUMN_SETS; set++) {
        if (column_set((int)set - (int)(OVER * parity) - (FIRST_X)) >= TAPS_X) continue; // no tap reads it
        global const float *line = from + set * set_step - LEFT;
        for (uint k = 0; k < WIDE; k++) {
            const float value = line[k], other = FOLD_Y ? line[mirror + k] : 0.0f;
            const float most = BRIGHT && value > limit ? limit : value, most_other = BRIGHT && other > limit ? limit : other;
            dim[set * WIDE + k] = most + most_other;
            if (BRIGHT) above[set * WIDE + k] = (value - most) + (other - most_other);
        }
    }
}

// Adds light up to the limit and beyond it that the photosite sees from its own surface through taps that mirror each other. from, radius:
// at one row. own, sharp: blur radius and light of the photosite itself. mirror: elements to the other row.
INLINE void add_near(global const float *from, global const float *radius, const float own, const float sharp, const long mirror,
                     const float edge, const float limit, float *dim, float *above) {
    __attribute__((opencl_unroll_hint(1 + FOLD_Y)))
    for (uint r = 0; r < 1 + FOLD_Y; r++) {
        const float away = radius[r * mirror] - own, change = from[r * mirror] - sharp;
        const float value = (BRIGHT ? sharp : 0.0f) + (away < edge && away > -edge ? change : 0.0f);
        const float most = BRIGHT && value > limit ? limit : value;
        *dim += most;
        *above += BRIGHT ? value - most : 0.0f;
    }
}

#endif
