// Light from small bright lights, by rays from points of the light to points of the photosite: which part of it is lost on the way.
// The light of a cell with the excess radiance E that nothing hides is E times the exact area of the pupil's image (the host's work).
// Lost is the mean over points q of the cell and x of the photosite of (1 - g u) (1 - T), where u = (q - x) / s lies in the pupil: T is
// the share that nearer surfaces and stops let through, g the slope of the light's radius.
//
// lost:   (pairs) float32.
// pairs:  (pairs, 2) uint32: place of the photosite in the frame (row * width + column), and number of the light.
// lights: (lights, 6) float32: row and column of the cell on the grid of samples, layer, signed blur radius s [photosites], its slopes in
//         x and y [photosites per photosite].
// spans:  (SPAN_ROWS, 2) float32, ends in x of the pupil's rows, whose y run evenly from -SPAN_REACH to SPAN_REACH [pupil radii].
#ifndef LENS_LIGHTS_H
#define LENS_LIGHTS_H
#include "lens_rays.h"

#ifdef SPAN_ROWS
struct light_ray {
    float y, x;           // place on the photosite [samples]
    float step_y, step_x; // direction [samples per photosite of radius]
    float u_y, u_x;       // place on the pupil [pupil radii]
    float tilt;           // 1 - g u; 0 where the ray misses the pupil
};

// The ray from point[2..3] of the light's cell to point[0..1] of the photosite whose first sample is [row, column].
INLINE struct light_ray ray_of(global const float *light, global const float *point, global const float *spans, const int row,
                               const int column) {
    struct light_ray ray;
    ray.y = point[1] * OVERSAMPLING;
    ray.x = point[0] * OVERSAMPLING;
    const float scale = 1.0f / (light[3] * OVERSAMPLING);
    ray.u_y = scale * ((light[0] - (float)row) + point[3] - ray.y);
    ray.u_x = scale * ((light[1] - (float)column) + point[2] - ray.x);
    ray.step_y = ray.u_y * OVERSAMPLING;
    ray.step_x = ray.u_x * OVERSAMPLING;
    const int line = whole((ray.u_y + SPAN_REACH) * (SPAN_ROWS / (2.0f * SPAN_REACH)));
    const bool open = line >= 0 && line < SPAN_ROWS && ray.u_x >= spans[2 * clamped(line, SPAN_ROWS)] &&
        ray.u_x <= spans[2 * clamped(line, SPAN_ROWS) + 1];
    ray.tilt = open ? 1.0f - light[4] * ray.u_x - light[5] * ray.u_y : 0.0f;
    return ray;
}
#endif

#endif
