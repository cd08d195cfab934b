// Photo response nonuniformity: mean electrons [e-] -> those of this photosite, mean * (1 + sigma * normal), not below 0.
#ifndef PRNU_H
#define PRNU_H
#include "plain_math.h"

INLINE float prnu(const float mean_e, const float normal, constant float *parameters) {
    return mean_e * larger(0.0f, 1.0f + PRNU_SIGMA * normal);
}

#endif
