// Random numbers of a photosite: normal numbers and random bits for the stages. The table lists which random words each stage
// uses. Philox (philox.h) computes a block of four words a, b, c, d from the counter {first, second, 0, stream} and the key:
// (frame_seed, 0) for temporal noise, (body_seed, 1) for fixed patterns of a camera body. x, y: photosite on the sensor.
// STREAM_...: see below; STEM_STREAM: CRC-32 of the stage's stem (kernel_program.py). A block at y / 2 serves a pair of rows.
//   stream                         key    first  second  words
//   STREAM_FRAME                   frame  y / 2  x       a, b, c with angles: shot noise, read noise before and after the gain, two
//                                                        normal numbers each; a and the first angle: small counts of either row
//   STREAM_BODY                    body   y / 2  x       b, c likewise: response and dark offset (PRNU, DSNU)
//   DARK_CURRENT_STREAM            frame  y / 2  x       a, b: two normal numbers; c, d: small counts
//   HOT_PIXELS_STREAM              frame  y / 2  x       a, b: two normal numbers; c, d: small counts
//   HOT_PIXELS_STREAM              body   y / 2  x       a, b: whether hot; c, d: mean
//   COLUMN_OFFSET_STREAM           body   0      x       a, b: a normal number
//   ROW_NOISE_STREAM               frame  y / 2  0       a, b: two normal numbers
//   BANDING_STREAM                 frame  0      0       a: phase
//   DEAD_PIXELS_STREAM             body   y / 2  x       a, b: whether dead
//   READ_NOISE_BEFORE_GAIN_STREAM  body   y      x       a, b: a normal number, for sigma
//   RANDOM_TELEGRAPH_NOISE_STREAM  body   y / 2  x       a, b: whether there is a trap; c, d: amplitude
//   RANDOM_TELEGRAPH_NOISE_STREAM  frame  y / 2  x       a, b: two lowest bits, the jump
//
// Where a block gives three pairs of normal numbers, a, b and c are their radii (normal.h), and d with the low bits of another
// radius their angles. The upper 21 bits of the angles and of a, 22 of b and c, are 128 independent bits. What is shared lies below
// 2^-21 of a radius' uniform number: seen beyond 5 sigma only. Each pair depends on the one before it (zero_after).
#ifndef RANDOM_NUMBERS_H
#define RANDOM_NUMBERS_H
#include "philox.h"
#include "poisson.h"
#include "random_places.h"

#define STREAM_FRAME 0u // with the key (frame_seed, 0)
#define STREAM_BODY 2u  // with the key (body_seed, 1)

// Angles of the Box-Muller method, see above, of the pairs whose radii are a, b and c.
INLINE uint angle_of_a(const struct words block) { return block.d ^ (block.b << 11); }
INLINE uint angle_of_b(const struct words block) { return (block.d ^ block.c) << 11; }
INLINE uint angle_of_c(const struct words block) { return (block.d << 22) ^ (block.a << 11); }

// Random words of the pair of rows of photosite (x, y). y comes first: what x does not change is then computed once per row.
INLINE struct words block_of(const uint x, const uint y, const uint stream, const uint key0, const uint key1) {
    const struct words counter = {y >> 1, x, 0u, stream};
    return philox(counter, key0, key1);
}

// Draw two normal numbers from a radius and an angle, one for each row, after `before` is computed. Returns the second.
INLINE float draw_pair(const uint radius, const uint angle, const float before, const int which, float *first, float *second) {
    normal_two(radius ^ zero_after(before), angle, &first[which], &second[which]);
    return second[which];
}

// The same from a block that serves nothing else.
INLINE float draw_pair_of_block(const struct words block, const float before, const int which, float *first, float *second) {
    return draw_pair(block.a, block.b, before, which, first, second);
}

// Draw the normal numbers of both rows. hot: 0 where no photosite is hot. Each pair waits for the one before (zero_after), but not row
// noise, so that it is computed once per row.
INLINE void draw_normals(const uint x, const uint y, const struct words frame, const uint frame_seed, const uint body_seed,
                         const uint hot, float *first, float *second) {
    const struct words body = block_of(x, y, STREAM_BODY, body_seed, 1u);
    float last = 0.0f;
    if (PHOTON_SHOT_NOISE && NEEDS_NORMAL(POISSON_VARIANT)) last = draw_pair(frame.a, angle_of_a(frame), last, SHOT, first, second);
    if (READ_NOISE_BEFORE_GAIN) last = draw_pair(frame.b, angle_of_b(frame), last, BEFORE, first, second);
    if (READ_NOISE_AFTER_GAIN) last = draw_pair(frame.c, angle_of_c(frame), last, AFTER, first, second);
    if (PRNU) last = draw_pair(body.b, angle_of_b(body), last, RESPONSE, first, second);
    if (DSNU) last = draw_pair(body.c, angle_of_c(body), last, OFFSET, first, second);
    if (DARK_CURRENT) last = draw_pair_of_block(block_of(x, y, DARK_CURRENT_STREAM, frame_seed, 0u), last, DARK, first, second);
    if (HOT_PIXELS && hot) last = draw_pair_of_block(block_of(x, y, HOT_PIXELS_STREAM, frame_seed, 0u), last, HOT, first, second);
    if (COLUMN_OFFSET) {
        last = draw_pair_of_block(block_of(x, 0u, COLUMN_OFFSET_STREAM, body_seed, 1u), last, COLUMN, first, second);
        second[COLUMN] = first[COLUMN];
    }
    if (ROW_NOISE) draw_pair_of_block(block_of(0u, y, ROW_NOISE_STREAM, frame_seed, 0u), 0.0f, ROW, first, second);
}

// Draw the random words of both rows.
INLINE void draw_bits(const uint x, const uint y, const struct words frame, const uint frame_seed, const uint body_seed, uint *first,
                      uint *second) {
    first[SHOT_COUNT] = frame.a, second[SHOT_COUNT] = angle_of_a(frame);
    const struct words dark = block_of(x, y, DARK_CURRENT_STREAM, frame_seed, 0u);
    first[DARK_COUNT] = dark.c, second[DARK_COUNT] = dark.d;
    const struct words hot = block_of(x, y, HOT_PIXELS_STREAM, frame_seed, 0u);
    first[HOT_COUNT] = hot.c, second[HOT_COUNT] = hot.d;
    const struct words body = block_of(x, y, HOT_PIXELS_STREAM, body_seed, 1u);
    first[HOT_SHARE] = body.a, second[HOT_SHARE] = body.b, first[HOT_MEAN] = body.c, second[HOT_MEAN] = body.d;
    const struct words dead = block_of(x, y, DEAD_PIXELS_STREAM, body_seed, 1u);
    first[DEAD] = dead.a, second[DEAD] = dead.b;
    const struct words trap = block_of(x, y, RANDOM_TELEGRAPH_NOISE_STREAM, body_seed, 1u);
    first[TRAP] = trap.a, second[TRAP] = trap.b, first[TRAP_SIZE] = trap.c, second[TRAP_SIZE] = trap.d;
    const struct words jump = block_of(x, y, RANDOM_TELEGRAPH_NOISE_STREAM, frame_seed, 0u);
    first[TRAP_JUMP] = jump.a, second[TRAP_JUMP] = jump.b;
}

#endif
