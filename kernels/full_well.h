// Full well: electrons [e-] -> at most the capacity [e-].
#ifndef FULL_WELL_H
#define FULL_WELL_H
#include "plain_math.h"

INLINE float full_well(const float electrons, constant float *parameters) { return smaller(electrons, FULL_WELL_CAPACITY_E); }

#endif
