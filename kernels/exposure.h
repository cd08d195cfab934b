// Exposure: electron irradiance [e- s^-1 um^-2] -> mean photoelectrons of one photosite [e-].
#ifndef EXPOSURE_H
#define EXPOSURE_H
#include "conventions.h"

INLINE float exposure(const float electron_irradiance, constant float *parameters) {
    return electron_irradiance * (EXPOSURE_COLLECTING_AREA_UM2 * EXPOSURE_TIME_S);
}

#endif
