// Light from small bright lights behind layers: which part nearer layers hide (lens_lights.h, lens_sampling.cl).
//
// coverage, radius, stops, points: as in lens_sampling.cl, but a point's last two numbers are y after x in the light's cell, 0 to 1.
// pairs, lights, spans: as in lens_lights.h. lost: (pairs) float32.
// Dimension 0: pairs of a photosite and a light.
#include "lens_lights.h"

kernel void lens_sampling_lights(global const float *restrict coverage, global const float *restrict radius,
                                 global const float *restrict points, global const float *restrict stops,
                                 global const uint *restrict pairs, global const float *restrict lights,
                                 global const float *restrict spans, global float *restrict lost, const uint iterations,
                                 const struct sample_grid grid, const struct rays rays) {
    const uint place = pairs[2 * get_global_id(0)], x_index = place % rays.width, y_index = place / rays.width;
    global const float *light = lights + 6 * pairs[2 * get_global_id(0) + 1];
    const int row = (int)((grid.margin + y_index) * OVERSAMPLING), column = (int)((grid.margin + x_index) * OVERSAMPLING);
    const size_t area = (size_t)grid.rows * grid.columns;
    const int sensor_x = rays.origin_x + (int)x_index, sensor_y = rays.origin_y + (int)y_index;
    global const float *point = points + (size_t)(place_bits((uint)sensor_x, (uint)sensor_y) % rays.patterns) * rays.samples * 4;
    float sum = 0.0f;
    for (uint i = 0; i < rays.samples; i++, point += 4) {
        const struct light_ray ray = ray_of(light, point, spans, row, column);
        float through = 1.0f;
        for (uint layer = 0; layer < (uint)light[2] && through > 0.0f; layer++) {
            global const float *map = radius + layer * area;
            float s = bilinear(map, row, column, ray.y, ray.x, grid);
            for (uint step = 0; step < iterations; step++)
                s = bilinear(map, row, column, ray.y + s * ray.step_y, ray.x + s * ray.step_x, grid);
            const int at_row = row + whole(ray.y + s * ray.step_y), at_column = column + whole(ray.x + s * ray.step_x);
            through *= 1.0f - coverage[layer * area + (size_t)clamped(at_row, grid.rows) * grid.columns + clamped(at_column, grid.columns)];
        }
#if STOPS
        const float off_x = (float)sensor_x - rays.centre_x, off_y = (float)sensor_y - rays.centre_y;
        if (!passes(stops, ray.u_y, ray.u_x, rays.tangent_per_px * (off_y + point[1]), rays.tangent_per_px * (off_x + point[0])))
            through = 0.0f;
#endif
        sum += ray.tilt * (1.0f - through);
    }
    lost[get_global_id(0)] = sum / (float)rays.samples;
}
