// Light from small bright lights in one picture with distances: which part nearer surfaces hide (lens_lights.h, height_field.h).
//
// radius, stops, first, last: as in lens_height_field.cl. points: as in lens_sampling_lights.cl. pairs, lights, spans: as in lens_lights.h.
// lost: (pairs) float32.
// Dimension 0: pairs of a photosite and a light.
#include "height_field.h"
#include "lens_lights.h"

#define NEAR 2 // samples that a ray may end beside the light on the light's own surface, whose steps the tilt 1 - g u accounts for

kernel void lens_height_field_lights(global const float *restrict radius, global const float *restrict points,
                                     global const float *restrict stops, global const uint *restrict pairs,
                                     global const float *restrict lights, global const float *restrict spans,
                                     global float *restrict lost, const int first, const int last, const struct sample_grid grid,
                                     const struct rays rays) {
    const uint place = pairs[2 * get_global_id(0)], x_index = place % rays.width, y_index = place / rays.width;
    global const float *light = lights + 6 * pairs[2 * get_global_id(0) + 1];
    const int row = (int)((grid.margin + y_index) * OVERSAMPLING), column = (int)((grid.margin + x_index) * OVERSAMPLING);
    const int sensor_x = rays.origin_x + (int)x_index, sensor_y = rays.origin_y + (int)y_index;
    global const float *point = points + (size_t)(place_bits((uint)sensor_x, (uint)sensor_y) % rays.patterns) * rays.samples * 4;
    float sum = 0.0f;
    for (uint i = 0; i < rays.samples; i++, point += 4) {
        const struct light_ray ray = ray_of(light, point, spans, row, column);
        if (ray.tilt == 0.0f) continue;
        const size_t end = seen(radius, row, column, ray.y, ray.x, ray.step_y, ray.step_x, first, last, grid);
        const int down = (int)(end / grid.columns) - (int)light[0], right = (int)(end % grid.columns) - (int)light[1];
        bool through = down <= NEAR && down >= -NEAR && right <= NEAR && right >= -NEAR && same(radius[end], light[3]);
#if STOPS
        const float off_x = (float)sensor_x - rays.centre_x, off_y = (float)sensor_y - rays.centre_y;
        through = through && passes(stops, ray.u_y, ray.u_x, rays.tangent_per_px * (off_y + point[1]), rays.tangent_per_px * (off_x + point[0]));
#endif
        sum += through ? 0.0f : ray.tilt;
    }
    lost[get_global_id(0)] = sum / (float)rays.samples;
}
