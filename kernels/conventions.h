// What every kernel file keeps to.
#ifndef CONVENTIONS_H
#define CONVENTIONS_H

// An a*b+c that one device fuses and another does not would break "same bits everywhere".
#pragma OPENCL FP_CONTRACT OFF

// A function that stays a call is not vectorised across photosites, and compilers stop inlining at the second use.
#define INLINE static inline __attribute__((always_inline))

// x, for x below 3e38. What is added to a signal and looks like it (two products, two sums) is otherwise the seed from which
// some compilers pair up both histories; see zero_after.
INLINE float apart(const float x) { return x < 3.0e38f ? x : 3.0e38f; }

// 0, but no compiler can know: what uses it comes after `value`. Two alike computations that could run side by
// side are paired by some compilers, which then fail to vectorise across photosites.
INLINE uint zero_after(const float value) { return value > 3.0e38f ? 1u : 0u; }

#endif
