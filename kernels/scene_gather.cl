// Lens blur of small circles in a scene finer than the photosites: the exact mean over a photosite's area and the image of the
// aperture, from the scene's pixels, each of them an even square (photosite_area.h). The aperture is a sum of rectangles:
//   light(x) = sum over rectangles k of share_k * mean of the scene over the photosite's square moved by all of s(x) * rectangle k,
// in which the mean over a rectangle is separable and has a closed form. LEANS 1: what lies farther down is moved to the right, and what
// lies farther right down, to the first order in each of SPLIT x SPLIT parts: the share of a pixel is
//   X Y + X' A + B Y'
// of shares X and Y, their change X' and Y' by a shift, and how far what lies in the pixel is moved, A to the right and B down
// (moved_interval.h). A circle leans by half of both: what turns it is in its rectangles. A surface that tilts moves the middle of its
// image by s grad(s) / 4 (simulator/optics/defocus/tilted_kernel.py, to the first order of the slope).
//
// planes:     (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// radius:     (maps, 2, map_rows, set_columns) float32, signed blur radius [photosites] in interleaved columns, OVER 1; GRADED 0: not
//             read, and each tile has its own.
// light:      (mosaics, height, width) float32 [e- s^-1 um^-2 sr^-1], of which one is made.
// tiles:      (tiles) struct gathered_tile. rectangles: (RECTANGLES) struct rectangle.
// pose:       as in projection.cl.
// TAPS:       most scene pixels on either axis that a photosite and its blur circle touch. INSET, LEANS, SPAN: as in projection.cl.
#include "conventions.h"
#include "cfa.h"
#include "gathered_span.h"
#include "lanes.h"
#include "moved_interval.h"
#include "plain_math.h"

struct gathered_tile {
    int column, row; // first photosite in the frame; negative where it lies in the margin
    float radius;    // signed, of all its photosites [photosites]
};

// Part of the aperture.
struct rectangle {
    float x, y;             // its middle [pupil radii]
    float reach_x, reach_y; // half of its width and of its height [pupil radii]
    float share;            // of the aperture's area
};

// Intervals that all of a rectangle's image of part `number` of the photosites of a span moves over, across and down.
INLINE void intervals_of(const struct gathered_span *span, const struct rectangle image, const uint number, struct intervals *x,
                         struct intervals *y) {
    const float part_x = ((float)(number % SPLIT) + 0.5f) / SPLIT - 0.5f, part_y = ((float)(number / SPLIT) + 0.5f) / SPLIT - 0.5f;
    LANES
    for (uint n = 0; n < SPAN; n++) {
        const float across = span->across[n], down = span->down[n], slope_x = span->slope_x[n], slope_y = span->slope_y[n];
        const float both = 0.5f * (slope_x + slope_y);
        const float wide = span->wide[n] * (1.0f / SPLIT), tall = span->tall[n] * (1.0f / SPLIT);
        const float image_x = across * image.x, image_y = down * image.y, away_x = part_x * span->wide[n], away_y = part_y * span->tall[n];
        float range_x = size_of(across) * image.reach_x, range_y = size_of(down) * image.reach_y;
#if LEANS
        // Three variances of what moves along an axis, each.
        const float moved_x = 0.25f * slope_x * slope_x * tall * tall + both * both * range_y * range_y + range_x * range_x;
        const float moved_y = 0.25f * slope_y * slope_y * wide * wide + both * both * range_x * range_x + range_y * range_y;
        range_x = moved_x * reciprocal_square_root(moved_x + LEAST_RANGE * LEAST_RANGE);
        range_y = moved_y * reciprocal_square_root(moved_y + LEAST_RANGE * LEAST_RANGE);
#endif
        x->middle[n] = span->left[n] + away_x + image_x + slope_x * away_y + both * image_y;
        y->middle[n] = span->top[n] + away_y + image_y + slope_y * away_x + both * image_x;
        x->wide[n] = wide, x->range[n] = larger(range_x, LEAST_RANGE), x->slope[n] = slope_y, x->moved_slope[n] = both;
        y->wide[n] = tall, y->range[n] = larger(range_y, LEAST_RANGE), y->slope[n] = slope_x, y->moved_slope[n] = both;
    }
}

// Dimension 0: spans of photosites of a tile; 1: its rows; 2: tiles.
kernel void scene_gather(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                         global const struct gathered_tile *restrict tiles, global const struct rectangle *restrict rectangles,
                         const uint scene_width, const uint scene_height, const float scale, const float offset_x,
                         const float offset_y, const struct gather frame, global const float *restrict pose) {
    const struct projection projection = projection_of(scene_width, scene_height, scale, offset_x, offset_y, pose);
    const struct gathered_tile tile = tiles[get_global_id(2)];
    const int column = tile.column + (int)(SPAN * get_global_id(0)), row = tile.row + (int)get_global_id(1);
    if (column <= -SPAN || row < 0 || column >= (int)frame.width || row >= (int)frame.height) return;
    struct gathered_span span;
    span_of(radius, frame, column, row, tile.radius, projection, &span);
    float weight[TAPS * TAPS][SPAN], sum[SPAN], total[SPAN];
    for (uint i = 0; i < TAPS * TAPS; i++)
        for (uint n = 0; n < SPAN; n++) weight[i][n] = 0.0f;
    for (uint k = 0; k < SPLIT * SPLIT * RECTANGLES; k++) {
        const struct rectangle image = rectangles[k % RECTANGLES];
        struct intervals x, y;
        float share_x[TAPS][SPAN], shift_x[TAPS][SPAN], aside_x[TAPS][SPAN], share_y[TAPS][SPAN], shift_y[TAPS][SPAN], aside_y[TAPS][SPAN];
        intervals_of(&span, image, k / RECTANGLES, &x, &y);
        shares_of(&x, share_x, shift_x, aside_x);
        shares_of(&y, share_y, shift_y, aside_y);
        for (uint i = 0; i < TAPS * TAPS; i++) {
            const uint right = i % TAPS, below = i / TAPS;
            LANES
            for (uint n = 0; n < SPAN; n++) {
                float share = share_x[right][n] * share_y[below][n];
#if LEANS
                share += shift_x[right][n] * aside_y[below][n] + aside_x[right][n] * shift_y[below][n];
#endif
                weight[i][n] += image.share * share;
            }
        }
    }
    for (uint n = 0; n < SPAN; n++) sum[n] = total[n] = 0.0f;
    for (uint i = 0; i < TAPS * TAPS; i++) {
        LANES
        for (uint n = 0; n < SPAN; n++) {
            const size_t channel = cfa_plane((uint)clamped(column + (int)n, frame.width), (uint)row);
            const size_t line = channel * scene_height + (size_t)clamped(span.first_y[n] + (int)(i / TAPS), scene_height);
            const float share = larger(weight[i][n], 0.0f);
            sum[n] += share * planes[line * scene_width + (size_t)clamped(span.first_x[n] + (int)(i % TAPS), scene_width)];
            total[n] += share;
        }
    }
    for (uint n = 0; n < SPAN; n++) {
        const int own = column + (int)n;
        if (own >= 0 && own < (int)frame.width) light[((size_t)frame.light_row + row) * frame.width + own] = sum[n] / total[n];
    }
}
