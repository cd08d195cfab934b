// Banding: signal [DN] -> signal + amplitude * sin(2 pi (y / period + phase)) [DN], the phase new in each frame; y: row.
// Random words: see the table in random_numbers.h.
#ifndef BANDING_H
#define BANDING_H
#include "normal.h"
#include "philox.h"

INLINE float banding(const float signal_dn, const uint y, const uint frame_seed, constant float *parameters) {
    const struct words counter = {0u, 0u, 0u, BANDING_STREAM};
    const float turns = (float)y * BANDING_TURNS_PER_ROW + uniform(philox(counter, frame_seed, 0u).a);
    const float turn = turns - nearest(turns);
    const float sine = sine_of_turn(turn > 0.25f ? 0.5f - turn : (turn < -0.25f ? -0.5f - turn : turn));
    return signal_dn + BANDING_AMPLITUDE_DN * sine;
}

#endif
