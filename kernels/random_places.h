// Places of the random numbers of a photosite (random_numbers.h) in the arrays that its stages get.
#ifndef RANDOM_PLACES_H
#define RANDOM_PLACES_H

// normals[]: standard normal numbers; those of the body are its fixed patterns.
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
#define SHOT_COUNT 0 // Poisson numbers of small means: photoelectrons
#define DARK_COUNT 1 // likewise: dark electrons
#define HOT_COUNT 2  // likewise: dark electrons of a hot pixel
#define HOT_SHARE 3  // of the body: whether a pixel is hot
#define HOT_MEAN 4   // of the body: its mean dark electrons
#define HOT_HERE 5   // 0 where no photosite is hot, a compile-time constant
#define DEAD 6       // of the body: whether a pixel is dead
#define TRAP 7       // of the body: whether a pixel has a trap
#define TRAP_SIZE 8  // of the body: what the trap holds
#define TRAP_JUMP 9  // how the trap changed
#define BITS 10

#endif
