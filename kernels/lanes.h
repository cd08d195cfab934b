// LANES before a loop over the photosites of a span asks for one vector of 16 floats: some compilers halve it, and compute the addresses
// of all samples twice. HEAD_LANES before one over the slabs of a list (slab_heads.h), which gathers, asks for a vector at all.
#ifndef LANES_H
#define LANES_H

#if SPAN >= 16
#define LANES _Pragma("clang loop vectorize_width(16) interleave_count(1)")
#define HEAD_LANES _Pragma("clang loop vectorize(enable) vectorize_width(16) interleave_count(1)")
#else
#define LANES
#define HEAD_LANES
#endif

#endif
