// What photosites gather from the surfaces around them through the kernels of one slab (kernels/psf_slabs.cl).
#ifndef PSF_SLAB_SUM_H
#define PSF_SLAB_SUM_H
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "psf_slabs.h"

#define VECTOR (SPAN >= 16 ? 16 : 1)
#define WIDE ((SPAN + MOST_TAPS / 2 + VECTOR) / VECTOR * VECTOR) // columns of a set that the taps of a span read, in whole vectors

// Light of a slab in a row of photosites, and what of it is covered: (2, WIDE) even and odd columns.
struct slab_row {
    float lit[2 * WIDE], held[2 * WIDE], above[BRIGHT ? 2 * WIDE : 1];
    uint any, high; // whether there is light of the slab, and any above the limit
};

// Adds to a span's sums, (NODE_SPAN, ROWS, SPAN) from this row's on, what `count` taps of a row gather. weight: (NODE_SPAN, ROOM), from
// the first tap on. light, held: from its sample on.
INLINE void add_taps(const float *weight, const float *light, const float *held, const size_t count, float *sum, float *seen) {
    for (size_t first = 0; first < count; first += CHUNK) {
        LANES
        for (uint i = 0; i < SPAN; i++) {
            float part[NODE_SPAN], covered[NODE_SPAN];
            __attribute__((opencl_unroll_hint(NODE_SPAN)))
            for (uint c = 0; c < NODE_SPAN; c++) part[c] = covered[c] = 0.0f;
            __attribute__((opencl_unroll_hint(CHUNK)))
            for (uint t = 0; t < CHUNK; t++) {
                const size_t at = t % 2 * WIDE + first / 2 + t / 2 + i;
                __attribute__((opencl_unroll_hint(NODE_SPAN)))
                for (uint c = 0; c < NODE_SPAN; c++) {
                    part[c] += weight[c * ROOM + first + t] * light[at];
                    covered[c] += weight[c * ROOM + first + t] * held[at];
                }
            }
            __attribute__((opencl_unroll_hint(NODE_SPAN)))
            for (uint c = 0; c < NODE_SPAN; c++) {
                sum[c * ROWS * SPAN + i] += part[c];
                seen[c * ROWS * SPAN + i] += covered[c];
            }
        }
    }
}

// The same of light alone.
INLINE void add_light(const float *weight, const float *light, const size_t count, float *sum) {
    for (uint c = 0; c < NODE_SPAN; c++)
        for (size_t first = 0; first < count; first += CHUNK) {
            LANES
            for (uint i = 0; i < SPAN; i++) {
                float part = 0.0f;
                __attribute__((opencl_unroll_hint(CHUNK)))
                for (uint t = 0; t < CHUNK; t++) part += weight[c * ROOM + first + t] * light[t % 2 * WIDE + first / 2 + t / 2 + i];
                sum[c * ROWS * SPAN + i] += part;
            }
        }
}

// Reads `count` columns of both sets, in whole vectors. from, cover, far: colour, coverage and place at the first of the even photosites.
INLINE void read_row(global const float *from, global const float *cover, global const float *far, const struct slab_term term,
                     const size_t set_step, const size_t count, const float limit, struct slab_row *row) {
    row->any = row->high = 0;
    for (size_t set = 0; set < 2; set++)
        for (size_t first = 0; first < count; first += VECTOR)
            for (size_t k = first; k < first + VECTOR; k++) {
                const float own = slab_share(term, far[set * set_step + k]), value = from[set * set_step + k];
                const float dim = BRIGHT && value > limit ? limit : value;
                row->lit[set * WIDE + k] = own * dim;
                if (BRIGHT) row->above[set * WIDE + k] = own * (value - dim);
                row->held[set * WIDE + k] = COVERAGE ? own * cover[set * set_step + k] : own;
                row->any |= own != 0.0f;
                row->high |= BRIGHT && value > limit;
            }
}

#endif
