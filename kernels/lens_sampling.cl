// Light behind a thin lens, sampled: the reference for every faster blur. A photosite is the mean over SAMPLES points of its own
// area and of the pupil; each ray meets the layers front to back:
//     light = mean over (x, u) of  sum_k C_k(x_k) prod_{j<k} (1 - A_j(x_j)),   x_k = x + s_k(x_k) u   (fixed point)
// A surface's radius is read bilinearly (a tilted plane stays exact), colour and coverage bilinearly or, CELLS, as the mean that
// the cell's number is. Past the grid its edge goes on. Positions are kept relative to the photosite and in whole samples, and
// the pattern of points depends on the place on the sensor alone: a crop has the bits of the whole frame.
//
// colour:   (layers, channels, rows, columns) float32, radiance * coverage, nearest layer first.
// coverage: (layers, rows, columns) float32, 0 to 1.
// radius:   (layers, rows, columns) float32, signed blur radius s [photosites], > 0 behind the focus.
// points:   (patterns, samples, 4) float32: y, x in the photosite from its upper left corner, 0 to 1; y, x on the pupil, -1 to 1.
// light:    (planes, height, width) float32, unit of colour: one plane with each photosite's own colour (MOSAIC) or all channels.
// OVERSAMPLING: samples per photosite and axis. margin: photosites around the frame. iterations: fixed-point steps; 0 where every
// layer has one radius. origin_x, origin_y: photosite on the sensor at [0, 0] of the frame.
// stops (STOPS of them, lens_rays.h) hide parts of the pupil, tangent_per_px (x - centre_x, y - centre_y) being the field: the mean
// is that of the rays that pass.
#include "cfa.h"
#include "lens_rays.h"

INLINE float surface(global const float *plane, const int row, const int column, const float y, const float x, const uint rows,
                     const uint columns) {
#if CELLS
    return plane[(size_t)clamped(row + whole(y), rows) * columns + clamped(column + whole(x), columns)];
#else
    return bilinear(plane, row, column, y, x, rows, columns);
#endif
}

kernel void lens_sampling(global const float *restrict colour, global const float *restrict coverage,
                          global const float *restrict radius, global const float *restrict points, global float *restrict light,
                          const uint layers, const uint channels, const uint rows, const uint columns, const uint margin,
                          const uint iterations, const uint patterns, const uint samples, const int origin_x,
                          const int origin_y, global const float *restrict stops, const float tangent_per_px, const float centre_x,
                          const float centre_y) {
    const size_t x_index = get_global_id(0), y_index = get_global_id(1), width = get_global_size(0), height = get_global_size(1);
    const uint channel = MOSAIC ? cfa_plane(x_index, y_index) : get_global_id(2);
    const int row = (int)((margin + y_index) * OVERSAMPLING), column = (int)((margin + x_index) * OVERSAMPLING);
    const size_t area = (size_t)rows * columns;
    const uint pattern = place_bits((uint)(origin_x + (int)x_index), (uint)(origin_y + (int)y_index)) % patterns;
    global const float *point = points + (size_t)pattern * samples * 4;
    const float sensor_x = (float)(origin_x + (int)x_index) - centre_x, sensor_y = (float)(origin_y + (int)y_index) - centre_y;
    uint taken = 0;
    float sum = 0.0f, lost = 0.0f; // Kahan's compensated sum: a flat field stays flat with any number of samples
    for (uint i = 0; i < samples; i++, point += 4) {
#if STOPS
        const float field_y = tangent_per_px * (sensor_y + point[0]), field_x = tangent_per_px * (sensor_x + point[1]);
        if (!passes(stops, point[2], point[3], field_y, field_x)) continue;
#endif
        taken++;
        const float y = point[0] * OVERSAMPLING, x = point[1] * OVERSAMPLING;
        const float step_y = point[2] * OVERSAMPLING, step_x = point[3] * OVERSAMPLING;
        float seen = 0.0f, through = 1.0f;
        for (uint layer = 0; layer < layers && through > 0.0f; layer++) {
            global const float *map = radius + layer * area;
            float s = bilinear(map, row, column, y, x, rows, columns);
            for (uint step = 0; step < iterations; step++)
                s = bilinear(map, row, column, y + s * step_y, x + s * step_x, rows, columns);
            const float at_y = y + s * step_y, at_x = x + s * step_x;
            const float c = surface(colour + (layer * channels + channel) * area, row, column, at_y, at_x, rows, columns);
            seen += through * c;
            through *= 1.0f - surface(coverage + layer * area, row, column, at_y, at_x, rows, columns);
        }
        const float added = seen - lost, next = sum + added;
        lost = (next - sum) - added;
        sum = next;
    }
    light[(get_global_id(2) * height + y_index) * width + x_index] = taken ? sum / (float)taken : 0.0f;
}
