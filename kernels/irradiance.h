// Lens: electron radiance [e- s^-1 um^-2 sr^-1] -> electron irradiance on the sensor [e- s^-1 um^-2].
// cos^4 of the field angle = 1 / (1 + tan^2)^2, tan^2 = r^2 (pitch / image distance)^2.
#ifndef IRRADIANCE_H
#define IRRADIANCE_H
#include "plain_math.h"

INLINE float irradiance(const float radiance, const uint x, const uint y, constant float *parameters) {
    const float dx = ((float)x + 0.5f) - IRRADIANCE_CENTRE_X_PX;
    const float dy = IRRADIANCE_CENTRE_Y_PX - ((float)y + 0.5f); // in another shape than dx: alike, some compilers pair them
    const float cos2 = reciprocal(1.0f + (dx * dx + dy * dy) * IRRADIANCE_TAN2_PER_PX2);
    return radiance * IRRADIANCE_SOLID_ANGLE_SR * (cos2 * cos2);
}

#endif
