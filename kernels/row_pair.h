// A pair of rows of the sensor at one column, from light to code: both rows share random words (random_numbers.h).
#ifndef ROW_PAIR_H
#define ROW_PAIR_H
#include "random_numbers.h"
#include "sensor_part.h"

INLINE float photosite(float signal, const uint x, const uint y, const float *normals, const uint *bits, const uint frame_seed,
                       const uint body_seed, constant float *parameters) {
    if (PART != READOUT) signal = charge(signal, x, y, normals, bits, frame_seed, body_seed, parameters);
    if (PART != CHARGE) signal = readout(signal, x, y, normals, frame_seed, body_seed, parameters);
    return signal;
}

// index: of the first photosite in `input` and `output`, which are `width` wide. x, y: that photosite on the sensor.
// hot: 0 where no photosite is hot, a compile-time constant.
INLINE void expose_row_pair(global const float *input, global result_type *output, size_t index, const uint width,
                            const uint x, const uint y, const uint frame_seed, const uint body_seed, constant float *parameters,
                            const uint hot) {
    const struct words frame = block_of(x, y, STREAM_FRAME, frame_seed, 0u);
    float last = 0.0f, first_normals[NORMALS], second_normals[NORMALS];
    uint first_bits[BITS], second_bits[BITS];
    draw_bits(x, y, frame, frame_seed, body_seed, first_bits, second_bits);
    first_bits[HOT_HERE] = second_bits[HOT_HERE] = hot;
    draw_normals(x, y, frame, frame_seed, body_seed, hot, first_normals, second_normals);
#if ROWS & FIRST_ROW
    const float first = photosite(input[index], x, y & ~1u, first_normals, first_bits, frame_seed, body_seed, parameters);
    output[index] = (result_type)first;
    last = first;
    index = index + width;
#endif
#if ROWS & SECOND_ROW
    const float second = as_float(as_uint(input[index]) ^ zero_after(last));
    output[index] = (result_type)photosite(second, x, y | 1u, second_normals, second_bits, frame_seed, body_seed, parameters);
#endif
}

#endif
