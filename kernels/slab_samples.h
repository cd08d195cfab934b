// Which samples of a slab count for the photosites of a work-item that look through one point of the aperture (slab_light.h).
#ifndef SLAB_SAMPLES_H
#define SLAB_SAMPLES_H
#include "conventions.h"
#define SETS 4             // of photosites: even or odd row, even or odd column
#define SIZE (ROWS * SPAN) // photosites of a set: ROWS rows, two apart, of SPAN columns of a column set
#define ALL (SETS * SIZE)  // photosites of a work-item

// Where the rays of a work-item's photosites meet the slab: each reads four samples, a, b to the right of it, c below it, and d. Where
// OVER is 1, neighbours share samples, whose radii are then read once.
struct slab_samples {
    global const float *light[SETS], *coverage, *radius; // planes; light: of the colour of each set, even row and even column first
    long rows[4], columns[4]; // elements to the samples a and c, a and b of the first even photosite, and to those of the first odd one
    long next;                // elements to the next photosites of a set below
    float wa, wb, wc, wd;     // bilinear weights
    float least, most;        // radii of the slab [photosites]
    float middle, lean_x, lean_y; // MOTION 1: radius at which the slab is read; way of the ray per radius across and down [samples per photosite]
    float across, down, right, below; // GROWS 1: place between the samples, 0 to 1, and what is added to it from row to row [samples]
};

// The same for row j, whose rays come a little later. Beyond the samples light is continued as a straight line.
INLINE struct slab_samples on_row(const struct slab_samples at, const uint j) {
    struct slab_samples found = at;
    const float f = at.across + (float)(int)j * at.right, g = at.down + (float)(int)j * at.below;
    found.wa = (1.0f - f) * (1.0f - g), found.wb = f * (1.0f - g), found.wc = (1.0f - f) * g, found.wd = f * g;
    return found;
}

struct weights { float a, b, c, d; };

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
INLINE struct weights meet(const float a, const float b, const float c, const float d, const struct slab_samples at) {
    const float x0 = b - a, x1 = d - c, y0 = c - a, y1 = d - b, stretch = 1.0f - 0.5f * ((x0 + x1) * at.lean_x + (y0 + y1) * at.lean_y);
    const float x = x0 * x0 > x1 * x1 ? x0 * x0 : x1 * x1, y = y0 * y0 > y1 * y1 ? y0 * y0 : y1 * y1, most = CONTINUOUS_PX / OVER;
    const int one = (x > y ? x : y) < most * most && stretch > 0.0f;
    const float read = at.wa * a + at.wb * b + at.wc * c + at.wd * d - at.middle;
    const float all = read < stretch * (at.least - at.middle) || read >= stretch * (at.most - at.middle) ? 0.0f : 1.0f;
    const struct weights found = {one ? all * at.wa : inside(a, at, at.wa), one ? all * at.wb : inside(b, at, at.wb),
                                  one ? all * at.wc : inside(c, at, at.wc), one ? all * at.wd : inside(d, at, at.wd)};
    return found;
}

// Weights of the samples of a photosite in an odd or even row (down 1 or 0) and column (across), at an element from the first one.
INLINE struct weights weigh(const struct slab_samples at, const long element, const uint down, const uint across) {
    global const float *a = at.radius + at.rows[2 * down] + element, *c = at.radius + at.rows[2 * down + 1] + element;
    const long left = at.columns[2 * across], right = at.columns[2 * across + 1];
    if (MOTION) return meet(a[left], a[right], c[left], c[right], at);
    const struct weights found = {inside(a[left], at, at.wa), inside(a[right], at, at.wb), inside(c[left], at, at.wc), inside(c[right], at, at.wd)};
    return found;
}

#endif
