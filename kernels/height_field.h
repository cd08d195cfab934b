// The first intersection of a ray with the surface of one picture with distances; lens_height_field.cl says by which rule.
#ifndef HEIGHT_FIELD_H
#define HEIGHT_FIELD_H
#include "lens_rays.h"

// Element of the sample that (y, x) [samples from the corner of sample [row, column]] falls into.
INLINE size_t cell(const int row, const int column, const float y, const float x, const struct sample_grid grid) {
    return (size_t)clamped(row + whole(y), grid.rows) * grid.columns + clamped(column + whole(x), grid.columns);
}

// Whether two samples with these radii belong to one surface: they differ by less than a diagonal step, with room for rounding.
INLINE bool same(const float a, const float b) { return a - b < 1.5f / OVERSAMPLING && b - a < 1.5f / OVERSAMPLING; }

#define REFINED 2 // steps to the place where a ray meets a slope; each brings it nearer by the slope

// Radius of the surface at (y, x) [samples], linear between samples; s beside an edge of the surface of that radius.
INLINE float linear_radius(global const float *radius, const int row, const int column, const float y, const float x, const float s,
                           const struct sample_grid grid) {
    const int top = row + whole(y - 0.5f), left = column + whole(x - 0.5f);
    const size_t y0 = (size_t)clamped(top, grid.rows) * grid.columns, y1 = (size_t)clamped(top + 1, grid.rows) * grid.columns;
    const size_t x0 = clamped(left, grid.columns), x1 = clamped(left + 1, grid.columns);
    const bool one = same(radius[y0 + x0], s) && same(radius[y0 + x1], s) && same(radius[y1 + x0], s) && same(radius[y1 + x1], s);
    return one ? bilinear(radius, row, column, y, x, grid) : s;
}

// Element of the sample at which a ray meets the surface that has the radius s near there.
INLINE size_t meets(global const float *radius, const int row, const int column, const float y, const float x, const float step_y,
                    const float step_x, const float s, const struct sample_grid grid) {
    float t = s;
    for (int step = 0; step < REFINED; step++) t = linear_radius(radius, row, column, y + t * step_y, x + t * step_x, s, grid);
    return cell(row, column, y + t * step_y, x + t * step_x, grid);
}

// Element of the sample on which a ray ends that starts at (y, x) [samples] in direction (step_y, step_x) [samples per photosite of
// radius]. It goes in steps of T_STEP [photosites of radius], half a sample or less each. The ray meets a surface at the surface's own radius, and may come onto it or leave it between two steps of t.
INLINE size_t seen(global const float *radius, const int row, const int column, const float y, const float x, const float step_y,
                   const float step_x, const int first, const int last, const struct sample_grid grid) {
    float front_radius = 3.0e38f; // of the surface that the ray was last in front of
    size_t front = 0;
    for (int i = first; i <= last; i++) {
        const float t = (float)i * T_STEP;
        const size_t here = cell(row, column, y + t * step_y, x + t * step_x, grid);
        const float s = radius[here];
        if (t >= front_radius && s > front_radius && !same(s, front_radius)) {
            const size_t met = meets(radius, row, column, y, x, step_y, step_x, front_radius, grid);
            if (same(radius[met], front_radius)) return met;
        }
        if (t < s) {
            front_radius = s;
            front = here;
            continue;
        }
        const size_t met = meets(radius, row, column, y, x, step_y, step_x, s, grid);
        if (s > front_radius || same(s, front_radius)) return same(radius[met], s) ? met : here;
        if (t - T_STEP < s && same(radius[met], s)) return met;
        if (t >= front_radius) return front;
    }
    return front;
}

#endif
