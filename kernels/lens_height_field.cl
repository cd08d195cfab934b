// Light behind a thin lens from one picture with distances (RGB-D), sampled. A ray is followed from the nearest radius to the
// farthest, x + t u, until it is no longer in front of the surface, t >= s(x + t u). Two samples whose radii differ by more than
// their distance belong to two surfaces, for rays pass between them. A ray that passes behind the nearer one goes on; what is
// hidden there continues the farther one: its radius and colour where the ray last saw it. Every ray ends on one colour, so a
// flat field stays flat.
//
// colour: (channels, rows, columns) float32, radiance. radius: (rows, columns) float32, signed blur radius s [photosites], > 0
// behind the focus. points: (patterns, samples, 4) float32: y, x in the photosite, 0 to 1; y, x on the pupil, -1 to 1.
// light: (planes, height, width) float32, unit of colour: one plane with each photosite's own colour (MOSAIC) or all channels.
// OVERSAMPLING: samples per photosite and axis. margin: photosites around the frame. first, last: steps of half a sample's radius
// before the least and after the greatest radius; all frames share them, so a crop has the bits of the whole. origin_x, origin_y:
// photosite on the sensor at [0, 0] of the frame.
// stops (STOPS of them, lens_rays.h) hide parts of the pupil, tangent_per_px (x - centre_x, y - centre_y) being the field: the mean
// is that of the rays that pass.
#include "cfa.h"
#include "lens_rays.h"

INLINE size_t cell(const int row, const int column, const float y, const float x, const uint rows, const uint columns) {
    return (size_t)clamped(row + whole(y), rows) * columns + clamped(column + whole(x), columns);
}

// Whether two samples are of one surface; the distance is a diagonal step's, with room for rounding.
INLINE bool same(const float a, const float b) { return a - b < 1.5f / OVERSAMPLING && b - a < 1.5f / OVERSAMPLING; }

// Sample that a ray from (y, x) in direction (step_y, step_x) [samples per photosite of radius] ends on. A surface is met where
// its own radius says; the ray may come onto it, or leave it, within the step.
INLINE size_t seen(global const float *radius, const int row, const int column, const float y, const float x, const float step_y,
                   const float step_x, const int first, const int last, const uint rows, const uint columns) {
    float front_radius = 3.0e38f; // of the surface that the ray was last in front of
    size_t front = 0;
    for (int i = first; i <= last; i++) {
        const float t = (float)i * (0.5f / OVERSAMPLING);
        const size_t here = cell(row, column, y + t * step_y, x + t * step_x, rows, columns);
        const float s = radius[here];
        if (t >= front_radius && s > front_radius && !same(s, front_radius)) {
            const size_t met = cell(row, column, y + front_radius * step_y, x + front_radius * step_x, rows, columns);
            if (same(radius[met], front_radius)) return met;
        }
        if (t < s) {
            front_radius = s;
            front = here;
            continue;
        }
        const size_t met = cell(row, column, y + s * step_y, x + s * step_x, rows, columns);
        if (s > front_radius || same(s, front_radius)) return same(radius[met], s) ? met : here;
        if (t - 0.5f / OVERSAMPLING < s && same(radius[met], s)) return met;
        if (t >= front_radius) return front;
    }
    return front;
}

kernel void lens_height_field(global const float *restrict colour, global const float *restrict radius,
                              global const float *restrict points, global float *restrict light, const uint channels,
                              const uint rows, const uint columns, const uint margin, const int first, const int last,
                              const uint patterns, const uint samples, const int origin_x, const int origin_y,
                              global const float *restrict stops, const float tangent_per_px, const float centre_x,
                              const float centre_y) {
    const size_t x_index = get_global_id(0), y_index = get_global_id(1), width = get_global_size(0), height = get_global_size(1);
    const uint channel = MOSAIC ? cfa_plane(x_index, y_index) : get_global_id(2);
    const int row = (int)((margin + y_index) * OVERSAMPLING), column = (int)((margin + x_index) * OVERSAMPLING);
    const uint pattern = place_bits((uint)(origin_x + (int)x_index), (uint)(origin_y + (int)y_index)) % patterns;
    global const float *plane = colour + (size_t)channel * rows * columns;
    global const float *point = points + (size_t)pattern * samples * 4;
    const float sensor_x = (float)(origin_x + (int)x_index) - centre_x, sensor_y = (float)(origin_y + (int)y_index) - centre_y;
    uint taken = 0;
    float sum = 0.0f, lost = 0.0f; // Kahan's compensated sum
    for (uint i = 0; i < samples; i++, point += 4) {
#if STOPS
        const float field_y = tangent_per_px * (sensor_y + point[0]), field_x = tangent_per_px * (sensor_x + point[1]);
        if (!passes(stops, point[2], point[3], field_y, field_x)) continue;
#endif
        taken++;
        const size_t end = seen(radius, row, column, point[0] * OVERSAMPLING, point[1] * OVERSAMPLING, point[2] * OVERSAMPLING,
                                point[3] * OVERSAMPLING, first, last, rows, columns);
        const float added = plane[end] - lost, next = sum + added;
        lost = (next - sum) - added;
        sum = next;
    }
    light[(get_global_id(2) * height + y_index) * width + x_index] = taken ? sum / (float)taken : 0.0f;
}
