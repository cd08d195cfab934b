// Sums over points of the aperture of the coverage of a layer and of the light behind it (layer_covariance.cl).
#ifndef LAYER_PAIR_H
#define LAYER_PAIR_H
#include "agreement.h"
#include "block_view.h"
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "mosaic_colors.h"
#include "row_band.h"
#define ROW (SETS * SPAN)    // of them in a pair of rows
#define SHARP_PX (OVER == 1 ? 0.5f : 0.0f) // blur circles inside their sample do not blur

// Where the photosites of a work-item see a layer through a point: elements to the samples above and below, to the left and the right, of those in
// even and odd rows and columns; and the bilinear weights.
struct layer_view {
    long rows[4], columns[4];
    float wa, wb, wc, wd;
};

INLINE struct layer_view view_layer(global const float *point, global const uint *block, const float radius, const struct row_band band) {
    const float s = radius > -SHARP_PX && radius < SHARP_PX ? 0.0f : radius;
    const struct block_view at = view_block(point, block, s, 0, band);
    const long set_columns = band.set_columns, plane = (long)band.sample_rows * set_columns;
    const int dx = at.dx, dy = at.dy;
    const float f = at.x - (float)dx, g = at.y - (float)dy;
    const struct layer_view found = {
        {dy * set_columns, (dy + 1) * set_columns, (dy + OVER) * set_columns, (dy + OVER + 1) * set_columns},
        {column_start(dx, plane), column_start(dx + 1, plane), column_start(dx + OVER, plane), column_start(dx + OVER + 1, plane)},
        (1.0f - f) * (1.0f - g), f * (1.0f - g), (1.0f - f) * g, f * g};
    return found;
}

// A plane as the photosite at this element of a set sees it.
INLINE float read_plane(global const float *plane, const struct layer_view v, const long element, const uint set) {
    const uint down = 2 * (set / 2), across = 2 * (set % 2);
    global const float *above = plane + v.rows[down] + element, *below = plane + v.rows[down + 1] + element;
    return v.wa * above[v.columns[across]] + v.wb * above[v.columns[across + 1]] + v.wc * below[v.columns[across]] + v.wd * below[v.columns[across + 1]];
}

// Sums over points of photosites: of coverage; and for each colour of light less `sharp`, and of its product with coverage.
struct pair_sums { float *cover, *light, *both; };

// Add a point to the sums of one photosite. set, i: of it; element: of it in its set.
INLINE void add_photosite(const struct pair_sums sums, const struct layer_view near, const struct layer_view far, global const float *coverage,
                          global const float *const *light, const float *sharp, const uint set, const uint i, const long element) {
    const float cover = read_plane(coverage, near, element, set);
    sums.cover[set * SPAN + i] += cover;
    __attribute__((opencl_unroll_hint(COLORS)))
    for (uint c = 0; c < COLORS; c++) {
        const uint m = c * ROW + set * SPAN + i;
        const float more = read_plane(light[of_color(c, set)], far, element, set) - sharp[m];
        sums.light[m] += more;
        sums.both[m] += cover * more;
    }
}

// Add points to the sums of the photosites of row j. coverage, light: planes at the work-item's first photosite.
INLINE void add_points(const struct pair_sums sums, const float *sharp, global const float *coverage, global const float *const *light, const uint j,
                       global const float *points, global const float *end, global const uint *block, const float near_px, const float far_px,
                       const struct row_band band) {
    float cover[ROW], sum[COLORS * ROW], both[COLORS * ROW], less[COLORS * ROW]; // in registers
    const struct pair_sums own = {cover, sum, both};
    const long next = 2 * OVER * (long)band.set_columns * j;
    for (uint m = 0; m < COLORS * ROW; m++) {
        const uint k = m / SPAN * SIZE + j * SPAN + m % SPAN;
        cover[m % ROW] = sums.cover[k % ALL], sum[m] = sums.light[k], both[m] = sums.both[k], less[m] = sharp[k];
    }
    for (; points < end; points += POINT) {
        const struct layer_view near = view_layer(points, block, near_px, band), far = view_layer(points, block, far_px, band);
        LANES
        for (uint i = 0; i < SPAN; i++) {
            add_photosite(own, near, far, coverage, light, less, 0, i, next + i);
            add_photosite(own, near, far, coverage, light, less, 1, i, next + i);
            add_photosite(own, near, far, coverage, light, less, 2, i, next + i);
            add_photosite(own, near, far, coverage, light, less, 3, i, next + i);
        }
    }
    for (uint m = 0; m < COLORS * ROW; m++) {
        const uint k = m / SPAN * SIZE + j * SPAN + m % SPAN;
        sums.cover[k % ALL] = cover[m % ROW], sums.light[k] = sum[m], sums.both[k] = both[m];
    }
}

// Covariance of photosite m over so many points.
INLINE float covariance(const struct pair_sums of, const uint color, const uint m, const float count) {
    const float light = of.light[color * ALL + m], share = 1.0f / count;
    return share * (of.both[color * ALL + m] - of.cover[m] * (share * light));
}

// Sum of the squared differences of a work-item's photosites between the covariance and `kept`, over those allowed at their light, about
// that of their own samples; `kept` becomes the covariance.
INLINE float disagreement(const struct pair_sums of, const uint color, const float *sharp, const float *own, float *kept, const uint count, const struct sampling by) {
    float off_all = 0.0f;
    for (uint i = 0; i < SIZE; i++) {
        float four = 0.0f;
        for (uint set = 0; set < SETS; set++) {
            const uint m = set * SIZE + i, k = color * ALL + m;
            const float share = 1.0f / (float)count, behind = sharp[k] + share * of.light[k];
            const float found = covariance(of, color, m, (float)count);
            four += allowed_part(found - kept[k], own[k] + (1.0f - share * of.cover[m]) * behind, by);
            kept[k] = found;
        }
        off_all += four;
    }
    return off_all;
}

#endif
