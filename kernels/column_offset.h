// Column offset: signal [DN] -> signal + N(0, sigma) of the column [DN]. normal: the column's, which belongs to the body.
#ifndef COLUMN_OFFSET_H
#define COLUMN_OFFSET_H
#include "conventions.h"

INLINE float column_offset(const float signal_dn, const float normal, constant float *parameters) {
    return signal_dn + COLUMN_OFFSET_SIGMA_DN * normal;
}

#endif
