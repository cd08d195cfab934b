// Which samples of a slab count for the photosites of a work-item that look through one point of the aperture (slab_light.h).
#ifndef SLAB_SAMPLES_H
#define SLAB_SAMPLES_H
#include "block_view.h"
#include "conventions.h"
#include "mosaic_colors.h"
#include "plain_math.h"

struct weights { float a, b, c, d; };

INLINE struct weights bilinear_weights(const float f, const float g) {
    return (struct weights){(1.0f - f) * (1.0f - g), f * (1.0f - g), (1.0f - f) * g, f * g};
}

// Where the rays of a work-item's photosites meet the slab: each reads four samples, a, b to the right of it, c below it, and d. Where
// OVER is 1, neighbours share samples, whose radii are then read once.
struct slab_samples {
    global const float *light[PLANES], *coverage, *radius; // planes; light: of `of_color`
    long rows[4], columns[4]; // elements to the samples a and c, a and b of the first even photosite, and to those of the first odd one
    long next;                // elements to the next photosites of a set below
    struct weights all;       // bilinear
    float least, most;        // radii of the slab [photosites]
    float middle, lean_x, lean_y; // MOTION 1: radius at which the slab is read; way of the ray per radius across and down [samples per photosite]
    float across, down, right, below; // GROWS 1: place between the samples of the first row, and what is added to it from row to row [samples]
    struct block_view view;        // GROWS or TURNS 1: where the block looks
    int set_columns, rows_of_band; // of samples
};

// The four samples of a photosite: elements from the first photosite's, and bilinear weights.
struct spot {
    long a, b, c, d;
    struct weights all;
};

// The same for row j, whose rays come a little later. They are up to BEYOND beyond the samples, where light is continued as a straight line;
// LAMPS 1: they read samples of their own, since lines from a lamp to its dark surroundings fall far below 0.
INLINE struct slab_samples on_row(const struct slab_samples at, const uint j) {
    struct slab_samples found = at;
    const float x = at.across + (float)(int)j * at.right, y = at.down + (float)(int)j * at.below;
    const int dx = LAMPS ? whole(x) : 0, dy = LAMPS ? whole(y) : 0;
    found.all = bilinear_weights(x - (float)dx, y - (float)dy);
#if LAMPS
    const int down = dy * at.set_columns, plane = at.rows_of_band * at.set_columns, first = at.view.dx + dx;
    found.rows[0] += down, found.rows[1] += down, found.rows[2] += down, found.rows[3] += down;
    found.columns[0] = column_start(first, plane), found.columns[1] = column_start(first + 1, plane);
    found.columns[2] = column_start(first + OVER, plane), found.columns[3] = column_start(first + OVER + 1, plane);
#endif
    return found;
}

// The samples of the photosite of column i and row j of a set, in an odd or even row (down 1 or 0) and column (across). wide, of TURNS 1: whether
// photosites look so far apart that each reads samples of its own; else those of the block, beyond which light is continued as a straight line.
INLINE struct spot spot_of(const int wide, const struct slab_samples at, const uint i, const uint j, const uint down, const uint across) {
    const long element = j * at.next + i, above = at.rows[2 * down] + element, below = at.rows[2 * down + 1] + element;
    const long left = at.columns[2 * across], right = at.columns[2 * across + 1];
    struct spot found = {above + left, above + right, below + left, below + right, at.all};
#if TURNS
    const int x = 2 * (int)i + (int)across, y = 2 * (int)j + (int)down;
    const struct turned_place t = at.view.at;
    const float u = t.x + (float)x * t.x_right + (float)y * (t.x_down + (float)x * t.x_both);
    const float v = t.y + (float)x * t.y_right + (float)y * (t.y_down + (float)x * t.y_both);
    const int dx = wide ? whole(u) : at.view.dx, dy = wide ? whole(v) : at.view.dy;
    found.all = bilinear_weights(u - (float)dx, v - (float)dy);
    if (wide) {
        const int column = limited(at.view.column + OVER * x + dx, 0, COLUMN_SETS * at.set_columns - 2), plane = at.rows_of_band * at.set_columns;
        const int first = limited(at.view.row + OVER * y + dy, 0, at.rows_of_band - 2) * at.set_columns - at.view.start;
        const int a = first + column_set(column) * plane + column_in_set(column), b = first + column_set(column + 1) * plane + column_in_set(column + 1);
        found.a = a, found.b = b, found.c = a + at.set_columns, found.d = b + at.set_columns;
    }
#endif
    return found;
}

// Weight of a sample in a slab: 0 outside its range of radii.
INLINE float inside(const float radius, const struct slab_samples at, const float weight) {
    return radius < at.least || radius >= at.most ? 0.0f : weight;
}

#define CONTINUOUS_PX 0.5f // largest change of the radius from photosite to photosite of one surface

// How far aside of a slab the radius may lie at which a ray that meets it there reads a continuous surface [slabs]. x, y: way of the ray per
// radius.
INLINE float beside_slab(const float x, const float y) {
    const float most = 0.5f * CONTINUOUS_PX * ((x < 0.0f ? -x : x) + (y < 0.0f ? -y : y));
    return most < 20.0f ? most : 20.0f;
}

// Weights of the samples of a photosite whose ray reads the radii a to d. Along the ray the radius of a continuous surface changes by `lean`
// per radius, so that a ray that reads R at the radius m of the slab's middle meets the surface at m + (R - m) / (1 - lean): all four samples
// count, or none. Where two surfaces are read, and where a surface leans so much that it turns its back, each sample counts by its own radius.
INLINE struct weights meet(const float a, const float b, const float c, const float d, const struct weights all, const struct slab_samples at) {
    const float x0 = b - a, x1 = d - c, y0 = c - a, y1 = d - b, stretch = 1.0f - 0.5f * ((x0 + x1) * at.lean_x + (y0 + y1) * at.lean_y);
    const float x = x0 * x0 > x1 * x1 ? x0 * x0 : x1 * x1, y = y0 * y0 > y1 * y1 ? y0 * y0 : y1 * y1, most = CONTINUOUS_PX / OVER;
    const int one = (x > y ? x : y) < most * most && stretch > 0.0f;
    const float read = all.a * a + all.b * b + all.c * c + all.d * d - at.middle;
    const float met = read < stretch * (at.least - at.middle) || read >= stretch * (at.most - at.middle) ? 0.0f : 1.0f;
    const struct weights found = {one ? met * all.a : inside(a, at, all.a), one ? met * all.b : inside(b, at, all.b),
                                  one ? met * all.c : inside(c, at, all.c), one ? met * all.d : inside(d, at, all.d)};
    return found;
}

// Weights of a photosite's samples in the slab.
INLINE struct weights weigh(const struct slab_samples at, const struct spot spot) {
    const float a = at.radius[spot.a], b = at.radius[spot.b], c = at.radius[spot.c], d = at.radius[spot.d];
    if (MOTION) return meet(a, b, c, d, spot.all, at);
    const struct weights found = {inside(a, at, spot.all.a), inside(b, at, spot.all.b), inside(c, at, spot.all.c), inside(d, at, spot.all.d)};
    return found;
}

#endif
