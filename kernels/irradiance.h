// Lens: electron radiance [e- s^-1 um^-2 sr^-1] -> electron irradiance on the sensor [e- s^-1 um^-2].
// cos^4 of the field angle = 1 / (1 + tan^2)^2, tan^2 = r^2 (pitch / image distance)^2; times the unobstructed share of the
// pupil (vignetting), interpolated between evenly spaced nodes from the axis to the sensor's corner.
// EFFECTIVE_SOLID_ANGLE_SR: projected solid angle of the exit pupil on the axis times the transmittance of the lens.
#ifndef IRRADIANCE_H
#define IRRADIANCE_H
#include "plain_math.h"

INLINE float open_share(const float radius2, constant float *parameters) {
    const float place = radius2 * reciprocal_square_root(radius2) * IRRADIANCE_NODES_PER_PX;
    const int node = (int)smaller(place, (float)(IRRADIANCE_VIGNETTING_COUNT - 2));
    const float inner = IRRADIANCE_VIGNETTING[node], outer = IRRADIANCE_VIGNETTING[node + 1];
    return inner + smaller(place - (float)node, 1.0f) * (outer - inner);
}

INLINE float irradiance(const float radiance, const uint x, const uint y, constant float *parameters) {
    const float dx = ((float)x + 0.5f) - IRRADIANCE_CENTRE_X_PX;
    const float dy = IRRADIANCE_CENTRE_Y_PX - ((float)y + 0.5f); // not in the form of dx, see zero_after
    const float radius2 = dx * dx + dy * dy;
    const float cos2 = reciprocal(1.0f + radius2 * IRRADIANCE_TAN2_PER_PX2);
    const float light = radiance * IRRADIANCE_EFFECTIVE_SOLID_ANGLE_SR * (cos2 * cos2);
    if (IRRADIANCE_VIGNETTING_COUNT == 0) return light;
    return light * open_share(as_float(as_uint(radius2) ^ zero_after(light)), parameters); // see zero_after
}

#endif
