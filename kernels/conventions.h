// What every kernel file keeps to.
#ifndef CONVENTIONS_H
#define CONVENTIONS_H

// An a*b+c that one device fuses and another does not would break "same bits everywhere".
#pragma OPENCL FP_CONTRACT OFF

// A function that stays a call is not vectorised across photosites, and compilers stop inlining at the second use.
#define INLINE static inline __attribute__((always_inline))

// 0, but no compiler can know: what uses it comes after `value`. Two alike computations that could run side by
// side are paired by some compilers, which then fail to vectorise across photosites.
INLINE uint zero_after(const float value) { return value > 3.0e38f ? 1u : 0u; }

#endif
