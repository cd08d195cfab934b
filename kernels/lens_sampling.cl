// Light of layers behind a thin lens, by rays: the reference that the fast blurs are compared with. A photosite is the mean over
// points x of its own area and u of the pupil. Each ray meets the layers front to back:
//     light = mean over (x, u) of  sum_k C_k(x_k) prod_{j<k} (1 - A_j(x_j)),   x_k = x + s_k(x_k) u
// with colour C, coverage A and signed blur radius s. x_k is found by fixed-point iteration. The radius is read bilinearly, so that
// a tilted plane is exact; colour and coverage bilinearly, or, CELLS 1, as the mean over the sample that x_k falls into. Beyond the
// grid its edge samples continue. The pattern of rays depends on the photosite's place on the sensor alone, and positions are counted
// from the photosite, so a crop has the bits of the whole frame.
//
// colour:   (layers, channels, grid) float32, radiance times coverage, nearest layer first.
// coverage: (layers, grid) float32, 0 to 1.
// radius:   (layers, grid) float32, signed blur radius s [photosites], > 0 behind the plane in focus.
// points:   (patterns, samples, POINT) float32: x, y from the photosite's upper left corner [photosites]; x, y on the pupil [pupil radii];
//           POINT above 4, where images move: for each layer, shifts at the ray's instant (lens_rays.h).
// stops:    (STOPS, 2) float32, rims that hide parts of the pupil (lens_rays.h); the mean is that of the rays that pass.
// light:    (planes, photosites) float32, unit of colour: MOSAIC 1: one plane with each photosite's own colour; 0: all channels.
// iterations: fixed-point steps; 0 where every layer has one radius. OVERSAMPLING: samples per photosite and axis.
// places: (photosites) uint32, row * width + column of the frame: those computed. Dimension 0: entries of `places`; 1: planes of `light`.
#include "cfa.h"
#include "lens_lights.h"
#include "lens_rays.h"

// Colour or coverage at (y, x) [samples], counted from the corner of sample [row, column].
INLINE float surface(global const float *plane, const int row, const int column, const float y, const float x,
                     const struct sample_grid grid) {
#if CELLS
    return plane[(size_t)clamped(row + whole(y), grid.rows) * grid.columns + clamped(column + whole(x), grid.columns)];
#else
    return bilinear(plane, row, column, y, x, grid);
#endif
}

kernel void lens_sampling(global const float *restrict colour, global const float *restrict coverage,
                          global const float *restrict radius, global const float *restrict points,
                          global const float *restrict stops, global const uint *restrict places, global float *restrict light,
                          const uint layers, const uint channels, const uint iterations, const struct sample_grid grid,
                          const struct rays rays) {
    const uint place = places[get_global_id(0)], x_index = place % rays.width, y_index = place / rays.width;
    const uint channel = MOSAIC ? cfa_plane(x_index, y_index) : get_global_id(1);
    const int row = (int)((grid.margin + y_index) * OVERSAMPLING), column = (int)((grid.margin + x_index) * OVERSAMPLING);
    const size_t area = (size_t)grid.rows * grid.columns;
    const int sensor_x = rays.origin_x + (int)x_index, sensor_y = rays.origin_y + (int)y_index;
    const uint pattern = place_bits((uint)sensor_x, (uint)sensor_y) % rays.patterns;
    global const float *point = points + (size_t)pattern * rays.samples * POINT;
    const float off_axis_x = (float)sensor_x - rays.centre_x, off_axis_y = (float)sensor_y - rays.centre_y; // [photosites]
    const float right = (float)sensor_x + 0.5f - rays.cell_x, down = (float)sensor_y + 0.5f - rays.cell_y; // from the cell's middle
    uint taken = 0;
    float sum = 0.0f, lost = 0.0f; // Kahan's compensated sum: a flat field stays flat with any number of samples
    for (uint i = 0; i < rays.samples; i++, point += POINT) {
#if STOPS
        const float field_y = rays.tangent_per_px * (off_axis_y + point[1]), field_x = rays.tangent_per_px * (off_axis_x + point[0]);
        if (!passes(stops, point[3], point[2], field_y, field_x)) continue;
#endif
        taken++;
        float seen = 0.0f, through = 1.0f;
        for (uint layer = 0; layer < layers && through > 0.0f; layer++) {
            const struct ray_path path = ray_path(point, layer, right, down);
            const float y = path.y, x = path.x, step_y = path.step_y, step_x = path.step_x;
            global const float *map = radius + layer * area;
            float s = bilinear(map, row, column, y, x, grid);
            for (uint step = 0; step < iterations; step++)
                s = bilinear(map, row, column, y + s * step_y, x + s * step_x, grid);
            const float at_y = y + s * step_y, at_x = x + s * step_x;
            const float c = surface(colour + (layer * channels + channel) * area, row, column, at_y, at_x, grid);
            seen += through * c;
            through *= 1.0f - surface(coverage + layer * area, row, column, at_y, at_x, grid);
        }
        const float added = seen - lost, next = sum + added;
        lost = (next - sum) - added;
        sum = next;
    }
    light[get_global_id(1) * get_global_size(0) + get_global_id(0)] = taken ? sum / (float)taken : 0.0f;
}

#ifdef SPAN_ROWS
// Which part of the light from small bright lights is hidden; points: the last two numbers are x, y in the light's cell, 0 to 1.
// pairs, lights, spans, lost: as in lens_lights.h. Dimension 0: pairs.
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
    float sum = 0.0f, all = 0.0f;
    for (uint i = 0; i <= rays.samples; i++, point += 4) {
        const struct light_ray ray = ray_of(light, point, i, rays.samples, spans, row, column);
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
        if (!passes(stops, ray.u_y, ray.u_x, rays.tangent_per_px * (off_y + ray.way.y), rays.tangent_per_px * (off_x + ray.way.x)))
            through = 0.0f;
#endif
        all += ray.weight;
        sum += ray.weight * (1.0f - through);
    }
    lost[get_global_id(0)] = all > 0.0f ? sum / all : 0.0f;
}
#endif
