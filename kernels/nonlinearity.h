// Nonlinearity: signal [DN] -> signal + its error [DN], interpolated between evenly spaced nodes from 0 to FULL_SCALE_DN.
#ifndef NONLINEARITY_H
#define NONLINEARITY_H
#include "plain_math.h"

INLINE float nonlinearity(const float signal_dn, constant float *parameters) {
    const float last = (float)(NONLINEARITY_ERRORS_DN_COUNT - 1);
    const float place = larger(0.0f, smaller(signal_dn * NONLINEARITY_NODES_PER_DN, last));
    const int node = (int)smaller(place, last - 1.0f);
    const float share = place - (float)node;
    const float below = NONLINEARITY_ERRORS_DN[node], above = NONLINEARITY_ERRORS_DN[node + 1];
    return signal_dn + apart(below + share * (above - below));
}

#endif
