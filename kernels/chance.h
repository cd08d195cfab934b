// The chance of a photosite: normal numbers and random bits of the stages that nearly every sensor has.
// One Philox block serves the two photosites (x, 2 pair) and (x, 2 pair + 1): random words are the larger part of the work.
//   frame block: word a, angle d: shot noise of both rows; word b, angle d << 11: both read noises of the first row;
//   word c, angle d << 22: of the second. body block, alike: response and offset of either row. Bits below the eleven (ten)
//   that an angle has to itself are the next one's or low bits of a radius: they fill in between, finer than 1/1000 turn.
// Stages that few sensors have draw blocks of their own.
#ifndef CHANCE_H
#define CHANCE_H
#include "normal.h"
#include "philox.h"

#define STREAM_FRAME 0u // of the key (frame_seed, 0)
#define STREAM_COUNT 1u // likewise: bits that count small numbers of electrons
#define STREAM_BODY 2u  // of the key (body_seed, 1)

#define FIRST_ROW 1 // ROWS of the pair that a launch computes: a frame may begin or end within one
#define SECOND_ROW 2
#define BOTH_ROWS 3

// chance[]: standard normal numbers.
#define SHOT 0     // photon shot noise
#define BEFORE 1   // read noise before the gain
#define AFTER 2    // read noise after the gain
#define RESPONSE 3 // of the body: photo response
#define OFFSET 4   // of the body: dark signal
#define CHANCES 5

INLINE uint angle_of_first(const struct words block) { return block.d << 11; }
INLINE uint angle_of_second(const struct words block) { return (block.d << 22) | (block.c & 0x003FFFFFu); }

// Numbers of one row; that of shot noise comes with the other row's.
INLINE void chance_of_row(const uint frame_word, const uint frame_angle, const uint body_word, const uint body_angle, float *chance) {
    normal_two(frame_word, frame_angle, &chance[BEFORE], &chance[AFTER]);
    normal_two(body_word ^ zero_after(chance[AFTER]), body_angle, &chance[RESPONSE], &chance[OFFSET]);
}

// Random words of the pair of rows that photosite (x, y) belongs to. y first: what a row has in common is then computed once.
INLINE struct words block_of(const uint x, const uint y, const uint stream, const uint key0, const uint key1) {
    const struct words counter = {y >> 1, x, 0u, stream};
    return philox(counter, key0, key1);
}

#endif
