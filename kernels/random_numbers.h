// The chance of a photosite: normal numbers and random bits of the stages that many sensors have. This table says which random
// words serve which stage. Philox (philox.h) makes four words a, b, c, d of the counter {first, second, 0, stream} and the key:
// (frame_seed, 0) for a frame, (body_seed, 1) for a camera body. x, y: photosite on the sensor. STREAM_...: below; STEM_STREAM:
// CRC-32 of the stage's stem (simulator/sensor/kernel/kernel_program.py). A block at y / 2 serves both rows of a pair, the even and the odd one.
//
//   stream                         key    first  second  words
//   STREAM_FRAME                   frame  y / 2  x       a, d: shot noise, two normal numbers; b, d << 11: both read noises of
//                                                        the even row; c, d << 22: of the odd row
//   STREAM_COUNT                   frame  y / 2  x       a, b: shot noise, small counts of either row
//   STREAM_BODY                    body   y / 2  x       b, d << 11: response and dark offset (PRNU, DSNU) of the even row;
//                                                        c, d << 22: of the odd row
//   DARK_CURRENT_STREAM            frame  y / 2  x       a, b: two normal numbers; c, d: small counts
//   HOT_PIXELS_STREAM              frame  y / 2  x       a, b: two normal numbers; c, d: small counts
//   HOT_PIXELS_STREAM              body   y / 2  x       a, b: whether hot; c, d: mean
//   COLUMN_OFFSET_STREAM           body   0      x       a, b: a normal number
//   ROW_NOISE_STREAM               frame  y / 2  0       a, b: two normal numbers
//   BANDING_STREAM                 frame  0      0       a: phase
//   DEAD_PIXELS_STREAM             body   y      x       a: whether dead
//   READ_NOISE_BEFORE_GAIN_STREAM  body   y      x       a, b: a normal number, for sigma
//   RANDOM_TELEGRAPH_NOISE_STREAM  body   y      x       a: whether there is a trap; b: amplitude
//   RANDOM_TELEGRAPH_NOISE_STREAM  frame  y      x       a: two lowest bits, the jump
//
// d << 11 and d << 22 are angles: bits below the eleven (ten) that an angle has to itself are the next one's or low bits of a
// radius: they fill in between, finer than 1/1000 turn. Each pair of numbers waits for the one before (zero_after).
#ifndef RANDOM_NUMBERS_H
#define RANDOM_NUMBERS_H
#include "normal.h"
#include "philox.h"

#define STREAM_FRAME 0u // of the key (frame_seed, 0)
#define STREAM_COUNT 1u // likewise: bits that count small numbers of electrons
#define STREAM_BODY 2u  // of the key (body_seed, 1)

#define FIRST_ROW 1 // ROWS of the pair that a launch computes: a frame may begin or end within one
#define SECOND_ROW 2
#define BOTH_ROWS 3

// normals[]: standard normal numbers.
#define SHOT 0     // photon shot noise
#define BEFORE 1   // read noise before the gain
#define AFTER 2    // read noise after the gain
#define RESPONSE 3 // of the body: photo response
#define OFFSET 4   // of the body: dark signal
#define DARK 5     // dark current
#define HOT 6      // dark current of a hot pixel
#define COLUMN 7   // of the body: column offset
#define ROW 8      // row noise
#define NORMALS 9

// bits[]: random words.
#define SHOT_COUNT 0 // count small numbers: of photons,
#define DARK_COUNT 1 // of dark electrons,
#define HOT_COUNT 2  // of those of a hot pixel
#define HOT_SHARE 3  // of the body: whether a pixel is hot
#define HOT_MEAN 4   // of the body: and how much
#define BITS 5

INLINE uint angle_of_first(const struct words block) { return block.d << 11; }
INLINE uint angle_of_second(const struct words block) { return (block.d << 22) | (block.c & 0x003FFFFFu); }

// Random words of the pair of rows that photosite (x, y) belongs to. y first: what a row has in common is then computed once.
INLINE struct words block_of(const uint x, const uint y, const uint stream, const uint key0, const uint key1) {
    const struct words counter = {y >> 1, x, 0u, stream};
    return philox(counter, key0, key1);
}

// Two normal numbers of a block, one for each row, that wait for `before`.
INLINE float pair_of_block(const struct words block, const float before, const int which, float *first, float *second) {
    normal_two(block.a ^ zero_after(before), block.b, &first[which], &second[which]);
    return second[which];
}

// Numbers that come in pairs; returns the zero for what follows. Row noise, the same along a row, is computed once for the row.
INLINE uint draw_normals_of_pair(const uint x, const uint y, const struct words frame, const uint frame_seed, const uint body_seed,
                           float *first, float *second) {
    normal_two(frame.a, frame.d, &first[SHOT], &second[SHOT]);
    float last = second[SHOT];
    if (DARK_CURRENT) last = pair_of_block(block_of(x, y, DARK_CURRENT_STREAM, frame_seed, 0u), last, DARK, first, second);
    if (HOT_PIXELS) last = pair_of_block(block_of(x, y, HOT_PIXELS_STREAM, frame_seed, 0u), last, HOT, first, second);
    if (COLUMN_OFFSET) {
        last = pair_of_block(block_of(x, 0u, COLUMN_OFFSET_STREAM, body_seed, 1u), last, COLUMN, first, second);
        second[COLUMN] = first[COLUMN];
    }
    if (ROW_NOISE) pair_of_block(block_of(0u, y, ROW_NOISE_STREAM, frame_seed, 0u), 0.0f, ROW, first, second);
    return zero_after(last);
}

INLINE void draw_bits_of_pair(const uint x, const uint y, const uint frame_seed, const uint body_seed, uint *first, uint *second) {
    const struct words count = block_of(x, y, STREAM_COUNT, frame_seed, 0u);
    first[SHOT_COUNT] = count.a, second[SHOT_COUNT] = count.b;
    const struct words dark = block_of(x, y, DARK_CURRENT_STREAM, frame_seed, 0u);
    first[DARK_COUNT] = dark.c, second[DARK_COUNT] = dark.d;
    const struct words hot = block_of(x, y, HOT_PIXELS_STREAM, frame_seed, 0u);
    first[HOT_COUNT] = hot.c, second[HOT_COUNT] = hot.d;
    const struct words body = block_of(x, y, HOT_PIXELS_STREAM, body_seed, 1u);
    first[HOT_SHARE] = body.a, second[HOT_SHARE] = body.b;
    first[HOT_MEAN] = body.c, second[HOT_MEAN] = body.d;
}

// Numbers of one row alone.
INLINE void draw_normals_of_row(const uint frame_word, const uint frame_angle, const uint body_word, const uint body_angle, float *normals) {
    normal_two(frame_word, frame_angle, &normals[BEFORE], &normals[AFTER]);
    normal_two(body_word ^ zero_after(normals[AFTER]), body_angle, &normals[RESPONSE], &normals[OFFSET]);
}

#endif
