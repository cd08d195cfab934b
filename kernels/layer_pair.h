// Sums over points of the aperture of the coverage of a layer and of the light behind it (layer_covariance.cl).
//
// The photosites of a work-item stand in all arrays row by row, [pair of rows][set][column], so that a row is one piece of them.
#ifndef LAYER_PAIR_H
#define LAYER_PAIR_H
#include "agreement.h"
#include "block_view.h"
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "layer_view.h"
#include "mosaic_colors.h"
#include "row_band.h"
#define ROW (SETS * SPAN)    // of them in a pair of rows
#define BATCH_POINTS (SPAN > 1 ? 32 : 1) // whose views are kept for all rows of a work-item: the fewest points of a block

// Sums over points of photosites: of coverage; and for each colour of light less `sharp`, and of its product with coverage.
struct pair_sums { float *cover, *light, *both; };

// Add a point to the sums of one photosite. set, i: of it; element: of it in its set.
INLINE void add_photosite(const struct pair_sums sums, const struct layer_view *near, const struct layer_view *far, global const float *coverage,
                          global const float *const *light, const float *sharp, const uint set, const uint i, const long element, const long set_columns) {
    const float cover = read_plane(coverage, near, element, set, set_columns);
    sums.cover[set * SPAN + i] += cover;
    __attribute__((opencl_unroll_hint(COLORS)))
    for (uint c = 0; c < COLORS; c++) {
        const uint m = c * ROW + set * SPAN + i;
        const float more = read_plane(light[of_color(c, set)], far, element, set, set_columns) - sharp[m];
        sums.light[m] += more;
        sums.both[m] += cover * more;
    }
}

// Add points to the sums of the photosites of row j. coverage, light: planes at the work-item's first photosite.
INLINE void add_to_row(const struct pair_sums sums, const float *sharp, global const float *coverage, global const float *const *light, const uint j,
                       const struct layer_view *near, const struct layer_view *far, const struct row_band band) {
    float cover[ROW], sum[COLORS * ROW], both[COLORS * ROW], less[COLORS * ROW]; // in registers
    const struct pair_sums own = {cover, sum, both};
    const long next = 2 * OVER * (long)band.set_columns * j, set_columns = band.set_columns;
    for (uint m = 0; m < ROW; m++) cover[m] = sums.cover[j * ROW + m];
    for (uint c = 0; c < COLORS; c++)
        for (uint m = 0; m < ROW; m++) {
            const uint k = c * ALL + j * ROW + m;
            sum[c * ROW + m] = sums.light[k], both[c * ROW + m] = sums.both[k], less[c * ROW + m] = sharp[k];
        }
    for (uint n = 0; n < BATCH_POINTS; n++) {
        LANES
        for (uint i = 0; i < SPAN; i++) {
            add_photosite(own, near + n, far + n, coverage, light, less, 0, i, next + i, set_columns);
            add_photosite(own, near + n, far + n, coverage, light, less, 1, i, next + i, set_columns);
            add_photosite(own, near + n, far + n, coverage, light, less, 2, i, next + i, set_columns);
            add_photosite(own, near + n, far + n, coverage, light, less, 3, i, next + i, set_columns);
        }
    }
    for (uint m = 0; m < ROW; m++) sums.cover[j * ROW + m] = cover[m];
    for (uint c = 0; c < COLORS; c++)
        for (uint m = 0; m < ROW; m++) sums.light[c * ALL + j * ROW + m] = sum[c * ROW + m], sums.both[c * ALL + j * ROW + m] = both[c * ROW + m];
}

// Add BATCH_POINTS points to the sums of all photosites. near_px, far_px: blur radii of the layers.
INLINE void add_points(const struct pair_sums sums, const float *sharp, global const float *coverage, global const float *const *light,
                       global const float *points, global const uint *block, const float near_px, const float far_px, const struct row_band band) {
    struct layer_view near[BATCH_POINTS], far[BATCH_POINTS];
    for (uint n = 0; n < BATCH_POINTS; n++) {
        view_layer(near + n, points + POINT * n, block, near_px, band);
        view_layer(far + n, points + POINT * n, block, far_px, band);
    }
    for (uint j = 0; j < ROWS; j++) add_to_row(sums, sharp, coverage, light, j, near, far, band);
}

// Covariance of photosite m over so many points.
INLINE float covariance(const struct pair_sums of, const uint color, const uint m, const float count) {
    const float light = of.light[color * ALL + m], share = 1.0f / count;
    return share * (of.both[color * ALL + m] - of.cover[m] * (share * light));
}

// Sum of the squared differences of a work-item's photosites between the covariance and `kept`, over those allowed at their light, about
// that of their own samples; `kept` becomes the covariance.
INLINE float disagreement(const struct pair_sums of, const uint color, const float *sharp, const float *own, float *kept, const uint count, const struct sampling by) {
    const float share = 1.0f / (float)count;
    float off_all = 0.0f, four[SPAN];
    for (uint j = 0; j < ROWS; j++) {
        for (uint i = 0; i < SPAN; i++) four[i] = 0.0f;
        for (uint set = 0; set < SETS; set++) {
            LANES
            for (uint i = 0; i < SPAN; i++) {
                const uint m = j * ROW + set * SPAN + i, k = color * ALL + m;
                const float behind = sharp[k] + share * of.light[k], found = covariance(of, color, m, (float)count);
                four[i] += allowed_part(found - kept[k], own[k] + (1.0f - share * of.cover[m]) * behind, by);
                kept[k] = found;
            }
        }
        for (uint i = 0; i < SPAN; i++) off_all += four[i];
    }
    return off_all;
}

#endif
