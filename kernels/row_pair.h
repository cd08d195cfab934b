// A pair of rows of the sensor at one column, from light to code: both rows share random words (random_numbers.h).
#ifndef ROW_PAIR_H
#define ROW_PAIR_H
#include "random_numbers.h"
#include "sensor_part.h"

INLINE float photosite(float signal, const uint x, const uint y, const float *normals, const uint *bits, const uint frame_seed,
                       const uint body_seed, constant float *parameters) {
    if (PART != READOUT) signal = charge(signal, x, y, normals, bits, parameters);
    if (PART != CHARGE) signal = readout(signal, x, y, normals, bits, frame_seed, body_seed, parameters);
    return signal;
}

// Where photosites of a row are: light to read, and where the result goes.
struct row {
    global const float *light;
    global result_type *result;
};

// The rows of a pair at a photosite, whose x and y on the sensor are given. hot: 0 where no photosite is hot, a compile-time constant.
INLINE void expose_row_pair(const struct row above, const struct row below, const size_t column, const uint x, const uint y,
                            const uint frame_seed, const uint body_seed, constant float *parameters, const uint hot) {
    const struct words frame = block_of(x, y, STREAM_FRAME, frame_seed, 0u);
    float first_normals[NORMALS], second_normals[NORMALS];
    uint first_bits[BITS], second_bits[BITS];
    draw_bits(x, y, frame, frame_seed, body_seed, first_bits, second_bits);
    first_bits[HOT_HERE] = second_bits[HOT_HERE] = hot;
    draw_normals(x, y, frame, frame_seed, body_seed, hot, first_normals, second_normals);
    const float first = photosite(above.light[column], x, y & ~1u, first_normals, first_bits, frame_seed, body_seed, parameters);
    above.result[column] = (result_type)first;
    const float second = as_float(as_uint(below.light[column]) ^ zero_after(first));
    below.result[column] = (result_type)photosite(second, x, y | 1u, second_normals, second_bits, frame_seed, body_seed, parameters);
}

// AT_ONCE columns from `first` of a pair of rows, none of which reads what another writes. On a CPU compilers make one vector of them,
// several registers, so that few instructions wait for the one before.
#if AT_ONCE > 1
#define WIDE _Pragma("clang loop vectorize(assume_safety) vectorize_width(AT_ONCE)")
#define NARROW _Pragma("clang loop vectorize(assume_safety) vectorize_width(16)") // for rare work, built in less time
#else
#define WIDE
#define NARROW
#endif
#define COLUMNS(vectors, statement) vectors for (size_t column = first; column < first + AT_ONCE; column++) { \
        const uint x = tile_x + (uint)column; \
        statement; \
    }

#endif
