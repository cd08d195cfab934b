// LANES before a loop over the photosites of a span asks for one vector of 16 floats: some compilers halve it, and compute the addresses
// of all samples twice.
#ifndef LANES_H
#define LANES_H

#if SPAN >= 16
#define LANES _Pragma("clang loop vectorize_width(16) interleave_count(1)")
#else
#define LANES
#endif

#endif
