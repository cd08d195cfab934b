// Row noise: signal [DN] -> signal + N(0, sigma) of the row [DN]. normal: the row's, new in each frame.
#ifndef ROW_NOISE_H
#define ROW_NOISE_H
#include "conventions.h"

INLINE float row_noise(const float signal_dn, const float normal, constant float *parameters) {
    return signal_dn + apart(ROW_NOISE_SIGMA_DN * normal);
}

#endif
