// Light of a span of photosites of one row and colour, STEP photosites apart, through layers that lie at places of their own
// (swept_layers.cl). The host defines LAYERS, and CHANNELS, after which the planes of a layer hold its coverage; READS, rows of pixels that
// a photosite reads; EDGES 0 where planes hold all pixels that are read, as STEP sets of columns; SQUARES, whether pixels are even squares;
// DRIFTS 1 where displacements change a little along a row (EDGES 1).
#ifndef LAYER_SPANS_H
#define LAYER_SPANS_H
#include "lanes.h"
#include "layer_lines.h"
#if DRIFTS
#include "layer_drift.h"
#endif
#include "row_view.h"

struct layers {
    int origin_x, origin_y;         // photosite of the sensor at [0, 0] of the frame
    uint width;                     // of the frame [photosites]
    int first_column;               // of the first span in the frame; spans begin at multiples of STEP SPAN photosites of the sensor
    uint first_row;                 // of the launch in the frame
    uint mosaic_row, colour;        // of the plane in `mosaic`; of the layers' planes (STEP 2: not read)
    uint instants, lines;           // of each line; of the table
    uint rows, above;               // of each line where there are several; those of the first above the launch
    uint grid_width, grid_height;   // of each plane [px]
    float side;                     // of a photosite's open part, EDGES 0 [px of the scene]
    float pivot_x;                  // DRIFTS 1: column of the sensor from which displacements are counted [photosites]
    int offset_x, offset_y;         // scene position of the sensor's upper left corner, DRIFTS 1: its pixel
    float beyond_x, beyond_y;       // and how far beyond where that begins, 0 to 1 [px]
};

#if DRIFTS
#define MIX(lines, n, line) mix_drift(lines, x + spot[n].left, spot[n], layers.grid_width, line + n * PIXELS)
#define READ(lines, n, line) read_drift(lines, line + n * PIXELS, edge, i, spot[n])
#else
#define MIX(lines, n, line) mix_line(lines, x + spot[n].left, shares + n * READS, layers.grid_width, line + n * PIXELS)
#define READ(lines, n, line) read(lines, line + n * PIXELS, edge, i, shares + n * READS, spot[n].past)
#endif

// Add layers from `begin` to `end` to `sum`, by the light `open` that reaches them or, where that is null, by `weight`; what they let
// through is added to `passed` if it is not null. edge: whether rows are mixed first. x, y: of the span's first photosite. place:
// of its row (EDGES 0).
INLINE void add_layers(global const float *const *planes, const struct spot *spots, const uint begin, const uint end, const uint colour,
                       const int x, const int y, const int edge, const float weight, const float *open, float *sum, float *passed,
                       const struct row_place place, const struct layers layers) {
    const size_t pixels = (size_t)layers.grid_width * layers.grid_height;
    struct lines light[LAYERS], cover[LAYERS];
    float shares[LAYERS * READS];
    struct spot spot[LAYERS];
    float line_light[LAYERS * PIXELS], line_cover[LAYERS * PIXELS];
    __attribute__((opencl_unroll_hint(LAYERS)))
    for (uint n = begin; n < end; n++) {
        spot[n] = spots[n];
        const float below = EDGES ? spot[n].below : spot[n].below + place.below;
        const int more = below < 1.0f ? 0 : 1, row = y + spot[n].row + (EDGES ? 0 : place.row + more), first = x + spot[n].left;
        const int left = edge ? 0 : column_of(first, layers.grid_width) + spot[n].left_phase;
        const int right = edge ? 0 : column_of(x + spot[n].right, layers.grid_width) + spot[n].right_phase;
        shares_of(EDGES ? below : below - (float)more, layers.side, shares + n * READS);
        light[n] = lines_of(planes[n] + colour * pixels, row, left, right, layers.grid_width, layers.grid_height);
        cover[n] = lines_of(planes[n] + (n + 1 < LAYERS ? CHANNELS : colour) * pixels, row, left, right, layers.grid_width, layers.grid_height);
        if (edge) {
            MIX(light[n], n, line_light);
            if (n + 1 < LAYERS) MIX(cover[n], n, line_cover);
        }
    }
    LANES
    for (uint i = 0; i < SPAN; i++) {
        float through = open ? open[i] : weight, seen = 0.0f;
        __attribute__((opencl_unroll_hint(LAYERS)))
        for (uint n = begin; n < end; n++) {
            seen += through * READ(light[n], n, line_light);
            if (n + 1 < LAYERS) through *= 1.0f - READ(cover[n], n, line_cover);
        }
        sum[i] += seen;
        if (passed) passed[i] += through;
    }
}

// Largest way over a span from its middle [px].
INLINE float drifted(const float slope, const float bend) {
    return MIDDLE * ((slope < 0.0f ? -slope : slope) + MIDDLE * (bend < 0.0f ? -bend : bend));
}

#if DRIFTS
// Where a span sees a layer: from its displacement around the middle. Rows are those of the pixels that are read, from which the middle lies
// `past` to the right.
INLINE struct spot spot_of(const struct drift drift, const struct layers layers) {
    const float bend = -drift.bend * (1.0f + drift.x_slope), across = layers.beyond_x + drift.x;
    const int left = whole(across - drifted(drift.x_slope, bend));
    const float past = across - (float)left, down = (layers.beyond_y + drift.y) - drift.y_slope * past;
    const int row = whole(down - drifted(drift.y_slope, 0.0f));
    const struct spot found = {row + layers.offset_y, left + layers.offset_x, left + layers.offset_x + 1, 0, 0,
                               past, down - (float)row, drift.x_slope, bend, drift.y_slope};
    return found;
}
#endif

// Whether all pixels that a span reads in layers from `begin` to `end` lie in its planes, and are two of two rows for each photosite.
INLINE int is_inside(const struct spot *spots, const uint begin, const uint end, const int x, const struct layers layers) {
    int inside = 1;
    for (uint n = begin; n < end && EDGES; n++) {
        const int first = x + spots[n].left;
        inside &= first >= 0 && first + PIXELS <= (int)layers.grid_width;
        if (DRIFTS) inside &= spots[n].past + drifted(spots[n].slope, spots[n].bend) <= 1.0f && spots[n].below + drifted(spots[n].tilt, 0.0f) <= 1.0f;
    }
    return inside;
}

#endif
