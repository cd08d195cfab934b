// Light behind a thin lens of one picture with distances (RGB-D), by rays. A ray is followed from the nearest blur radius to the
// farthest, x + t u, until it reaches the surface: t >= s(x + t u). Two samples whose radii differ by more than their distance belong
// to two surfaces, and rays pass between them. What lies hidden behind the nearer one is not in the picture; there the farther surface
// continues with the radius and colour at which the ray last saw it. Every ray ends on one colour, so a flat field stays flat.
//
// colour: (channels, grid) float32, radiance.
// radius: (rows, columns) float32, signed blur radius s [photosites], > 0 behind the plane in focus.
// points: (patterns, samples, POINT) float32, as in lens_sampling.cl.
// stops:  (STOPS, 2) float32, rims that hide parts of the pupil (lens_rays.h); the mean is that of the rays that pass.
// light:  (planes, photosites) float32, unit of colour: MOSAIC 1: one plane with each photosite's own colour; 0: all channels.
// first, last: steps of t, from before the least radius to beyond the greatest [T_STEP photosites]. All frames of a
//         picture share them, so a crop has the bits of the whole. OVERSAMPLING: samples per photosite and axis.
// places: (photosites) uint32, row * width + column of the frame: those that are computed.
// Dimension 0: entries of `places`; 1: planes of `light`.
#include "cfa.h"
#include "height_field.h"
#include "lens_lights.h"
#include "lens_rays.h"

kernel void lens_height_field(global const float *restrict colour, global const float *restrict radius,
                              global const float *restrict points, global const float *restrict stops,
                              global const uint *restrict places, global float *restrict light, const int first,
                              const int last, const struct sample_grid grid, const struct rays rays) {
    const uint place = places[get_global_id(0)], x_index = place % rays.width, y_index = place / rays.width;
    const uint channel = MOSAIC ? cfa_plane(x_index, y_index) : get_global_id(1);
    const int row = (int)((grid.margin + y_index) * OVERSAMPLING), column = (int)((grid.margin + x_index) * OVERSAMPLING);
    const int sensor_x = rays.origin_x + (int)x_index, sensor_y = rays.origin_y + (int)y_index;
    const uint pattern = place_bits((uint)sensor_x, (uint)sensor_y) % rays.patterns;
    global const float *plane = colour + (size_t)channel * grid.rows * grid.columns;
    global const float *point = points + (size_t)pattern * rays.samples * POINT;
    const float off_axis_x = (float)sensor_x - rays.centre_x, off_axis_y = (float)sensor_y - rays.centre_y; // [photosites]
    const float right = (float)sensor_x + 0.5f - rays.cell_x, down = (float)sensor_y + 0.5f - rays.cell_y; // from the cell's middle
    uint taken = 0;
    float sum = 0.0f, lost = 0.0f; // Kahan's compensated sum
    for (uint i = 0; i < rays.samples; i++, point += POINT) {
#if STOPS
        const float field_y = rays.tangent_per_px * (off_axis_y + point[1]), field_x = rays.tangent_per_px * (off_axis_x + point[0]);
        if (!passes(stops, point[3], point[2], field_y, field_x)) continue;
#endif
        taken++;
        const struct ray_path path = ray_path(point, 0, right, down);
        const size_t end = seen(radius, row, column, path.y, path.x, path.step_y, path.step_x, first, last, grid);
        const float added = plane[end] - lost, next = sum + added;
        lost = (next - sum) - added;
        sum = next;
    }
    light[get_global_id(1) * get_global_size(0) + get_global_id(0)] = taken ? sum / (float)taken : 0.0f;
}

#ifdef SPAN_ROWS
// Which part of the light from small bright lights is hidden; points: the last two numbers are x, y in the light's cell, 0 to 1.
// pairs, lights, spans, lost: as in lens_lights.h. Dimension 0: pairs.
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
    float sum = 0.0f, all = 0.0f;
    for (uint i = 0; i <= rays.samples; i++, point += 4) {
        const struct light_ray ray = ray_of(light, point, i, rays.samples, spans, row, column);
        if (ray.weight == 0.0f) continue;
        const size_t end = seen(radius, row, column, ray.y, ray.x, ray.step_y, ray.step_x, first, last, grid);
        const int down = (int)(end / grid.columns) - (int)light[0], right = (int)(end % grid.columns) - (int)light[1];
        bool through = down <= NEAR && down >= -NEAR && right <= NEAR && right >= -NEAR && same(radius[end], light[3]);
#if STOPS
        const float off_x = (float)sensor_x - rays.centre_x, off_y = (float)sensor_y - rays.centre_y;
        const float field_y = rays.tangent_per_px * (off_y + ray.way.y), field_x = rays.tangent_per_px * (off_x + ray.way.x);
        through = through && passes(stops, ray.u_y, ray.u_x, field_y, field_x);
#endif
        all += ray.weight;
        sum += through ? 0.0f : ray.weight;
    }
    lost[get_global_id(0)] = all > 0.0f ? sum / all : 0.0f;
}
#endif
