// Conventions of all kernel files.
#ifndef CONVENTIONS_H
#define CONVENTIONS_H

// Results must have the same bits on every device, so no device may fuse a * b + c into one operation.
#pragma OPENCL FP_CONTRACT OFF

// Compilers may ignore requests for vectors without a word.
#pragma clang diagnostic ignored "-Wpass-failed"

// Functions must be inlined to be vectorised across photosites; without this attribute compilers do not inline those used twice.
#define INLINE static inline __attribute__((always_inline))

// Returns x, for x below 3e38. It keeps some compilers from combining two computations of the same form (two products, two sums)
// into one vector where their results are added; see zero_after.
INLINE float apart(const float x) { return x < 3.0e38f ? x : 3.0e38f; }

// Returns 0, which no compiler can know, so that what uses it is computed after `value`. Some compilers combine two similar
// computations that could run side by side into one vector, and then cannot vectorise across photosites.
INLINE uint zero_after(const float value) { return value > 3.0e38f ? 1u : 0u; }

#endif
