// Light from small bright lights, by rays from points of the light to points of the photosite: which part of it is lost on the way.
// The light of a cell with the excess radiance E that nothing hides is E times the exact area of the pupil's image (the host's work).
// Lost is the mean of 1 - T, weighted by 1 - g u, over points q of the cell and x of the photosite for which u = (q - x) / s lies in the
// pupil: T is the share that nearer surfaces and stops let through, g the slope of the light's radius. All is lost of what is all hidden.
//
// lost:   (pairs) float32, 0 to 1.
// pairs:  (pairs, 2) uint32: place of the photosite in the frame (row * width + column), and number of the light.
// lights: (lights, 6) float32: row and column of the cell on the grid of samples, layer, signed blur radius s [photosites], its slopes in
//         x and y [photosites per photosite].
// spans:  (SPAN_ROWS, 2) float32, ends in x of the pupil's rows, whose y run evenly from -SPAN_REACH to SPAN_REACH [pupil radii].
#ifndef LENS_LIGHTS_H
#define LENS_LIGHTS_H
#include "lens_rays.h"

#ifdef SPAN_ROWS
// Where a ray ends: x, y on the photosite [photosites], and in the light's cell.
struct way {
    float x, y, light_x, light_y;
};

#define SHORTEST 1e-6f // weight of the shortest way, beside others that go through the pupil

struct light_ray {
    float y, x;           // place on the photosite [samples]
    float step_y, step_x; // direction [samples per photosite of radius]
    float u_y, u_x;       // place on the pupil [pupil radii]
    float weight;         // 1 - g u, of the shortest way SHORTEST times that; 0 where the ray misses the pupil
    struct way way;
};

// The way of ray i: points of a set come first, then the shortest way, which tells where no other goes through the pupil.
INLINE struct way way_of(global const float *light, global const float *point, const uint i, const uint samples, const int row,
                         const int column) {
    if (i < samples) {
        const struct way found = {point[0], point[1], point[2], point[3]};
        return found;
    }
    const float right = light[1] - (float)column, down = light[0] - (float)row; // of the cell [samples from the photosite's corner]
    const float x = smaller(larger(right + 0.5f, 0.0f), (float)OVERSAMPLING), y = smaller(larger(down + 0.5f, 0.0f), (float)OVERSAMPLING);
    const float light_x = smaller(larger(x - right, 0.0f), 1.0f), light_y = smaller(larger(y - down, 0.0f), 1.0f);
    const struct way shortest = {x * (1.0f / OVERSAMPLING), y * (1.0f / OVERSAMPLING), light_x, light_y};
    return shortest;
}

// Ray i from a place in the light's cell to one on the photosite whose first sample is [row, column].
INLINE struct light_ray ray_of(global const float *light, global const float *point, const uint i, const uint samples,
                               global const float *spans, const int row, const int column) {
    const struct way way = way_of(light, point, i, samples, row, column);
    struct light_ray ray;
    ray.way = way;
    ray.y = way.y * OVERSAMPLING;
    ray.x = way.x * OVERSAMPLING;
    const float scale = 1.0f / (light[3] * OVERSAMPLING);
    ray.u_y = scale * ((light[0] - (float)row) + way.light_y - ray.y);
    ray.u_x = scale * ((light[1] - (float)column) + way.light_x - ray.x);
    ray.step_y = ray.u_y * OVERSAMPLING;
    ray.step_x = ray.u_x * OVERSAMPLING;
    const int line = whole((ray.u_y + SPAN_REACH) * (SPAN_ROWS / (2.0f * SPAN_REACH)));
    const bool open = line >= 0 && line < SPAN_ROWS && ray.u_x >= spans[2 * clamped(line, SPAN_ROWS)] &&
        ray.u_x <= spans[2 * clamped(line, SPAN_ROWS) + 1];
    ray.weight = open ? (1.0f - light[4] * ray.u_x - light[5] * ray.u_y) * (i < samples ? 1.0f : SHORTEST) : 0.0f;
    return ray;
}
#endif

#endif
