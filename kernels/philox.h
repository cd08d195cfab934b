// Philox4x32-10, a counter-based generator (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3").
// The same counter and key give the same four words on every device, in any order of work. Which stage uses which words: random_numbers.h.
#ifndef PHILOX_H
#define PHILOX_H
#include "conventions.h"

struct words { uint a, b, c, d; };

// counter: 128 bits, key: 64 bits -> 128 random bits. The words are the low halves of 64-bit lanes, which is what the multipliers of
// vector units read; narrowing and widening them in every round would cost more than the product. What stands in the high halves,
// of the keys, too, reaches no word.
INLINE struct words philox(const struct words counter, const uint key0, const uint key1) {
    ulong a = counter.a, b = counter.b, c = counter.c, d = counter.d;
    const ulong wide0 = key0, wide1 = key1;
#define LOW(v) ((v) & 0xFFFFFFFFul)
#define ROUND(n) { \
        const ulong product0 = LOW(a) * 0xD2511F53ul, product1 = LOW(c) * 0xCD9E8D57ul; \
        a = (product1 >> 32) ^ b ^ (wide0 + (n) * 0x9E3779B9ul); \
        c = (product0 >> 32) ^ d ^ (wide1 + (n) * 0xBB67AE85ul); \
        b = product1; \
        d = product0; \
    }
    ROUND(0) ROUND(1) ROUND(2) ROUND(3) ROUND(4) ROUND(5) ROUND(6) ROUND(7) ROUND(8) ROUND(9)
#undef ROUND
#undef LOW
    const struct words result = {(uint)a, (uint)b, (uint)c, (uint)d};
    return result;
}

#endif
