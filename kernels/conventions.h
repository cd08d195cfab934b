// What every kernel file keeps to.
#ifndef CONVENTIONS_H
#define CONVENTIONS_H

// An a*b+c that one device fuses and another does not would break "same bits everywhere".
#pragma OPENCL FP_CONTRACT OFF

// A function that stays a call is not vectorised across photosites, and compilers stop inlining at the second use.
#define INLINE static inline __attribute__((always_inline))

#endif
