// Hot pixels: electrons [e-] -> electrons + Poisson(mean of this photosite) [e-] in a share of the photosites.
// That mean is drawn once for the body, exponentially distributed around MEAN_E. x, y: photosite on the sensor.
#ifndef HOT_PIXELS_H
#define HOT_PIXELS_H
#include "philox.h"
#include "poisson.h"

INLINE float hot_pixels(const float electrons, const uint x, const uint y, const uint frame_seed, const uint body_seed,
                        constant float *parameters) {
    const struct words counter = {y, x, 0u, HOT_PIXELS_STREAM};
    const struct words body = philox(counter, body_seed, 1u), random = philox(counter, frame_seed, 0u);
    const float normal = normal_one(random.a ^ zero_after(electrons), random.b);
    const float mean_e = HOT_PIXELS_MEAN_E * exponential_variate(body.b ^ zero_after(normal));
    const float dark_e = poisson(mean_e, normal, random.c ^ zero_after(mean_e), ALL_MEANS);
    return electrons + (uniform(body.a) < HOT_PIXELS_SHARE ? dark_e : 0.0f);
}

#endif
