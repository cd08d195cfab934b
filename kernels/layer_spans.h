// Light of a span of photosites of one row and colour, STEP photosites apart, through layers that lie at places of their own
// (swept_layers.cl). The host defines LAYERS, and CHANNELS, after which the planes of a layer hold its coverage; READS, rows of pixels that
// a photosite reads; EDGES 0 where planes hold all pixels that are read, as STEP sets of columns; SQUARES, whether pixels are even squares.
#ifndef LAYER_SPANS_H
#define LAYER_SPANS_H
#include "lanes.h"
#include "layer_lines.h"

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
};

// Add layers from `begin` to `end` to `sum`, by the light `open` that reaches them or, where that is null, by `weight`; what they let
// through is added to `passed` if it is not null. edge: whether pixels lie beyond the planes. x, y: of the span's first photosite. place:
// of its row (EDGES 0).
INLINE void add_layers(global const float *const *planes, global const struct spot *spots, const uint begin, const uint end, const uint colour,
                       const int x, const int y, const int edge, const float weight, const float *open, float *sum, float *passed,
                       const struct row_place place, const struct layers layers) {
    const size_t pixels = (size_t)layers.grid_width * layers.grid_height;
    struct lines light[LAYERS], cover[LAYERS];
    float shares[LAYERS * READS], past[LAYERS];
    float line_light[LAYERS * PIXELS], line_cover[LAYERS * PIXELS];
    __attribute__((opencl_unroll_hint(LAYERS)))
    for (uint n = begin; n < end; n++) {
        const struct spot spot = spots[n];
        const float below = EDGES ? spot.below : spot.below + place.below;
        const int more = below < 1.0f ? 0 : 1, row = y + spot.row + (EDGES ? 0 : place.row + more), first = x + spot.left;
        const int left = edge ? 0 : column_of(first, layers.grid_width) + spot.left_phase;
        const int right = edge ? 0 : column_of(x + spot.right, layers.grid_width) + spot.right_phase;
        past[n] = spot.past;
        shares_of(EDGES ? below : below - (float)more, layers.side, shares + n * READS);
        light[n] = lines_of(planes[n] + colour * pixels, row, left, right, layers.grid_width, layers.grid_height);
        cover[n] = lines_of(planes[n] + (n + 1 < LAYERS ? CHANNELS : colour) * pixels, row, left, right, layers.grid_width, layers.grid_height);
        if (edge) {
            mix_line(light[n], first, shares + n * READS, layers.grid_width, line_light + n * PIXELS);
            if (n + 1 < LAYERS) mix_line(cover[n], first, shares + n * READS, layers.grid_width, line_cover + n * PIXELS);
        }
    }
    LANES
    for (uint i = 0; i < SPAN; i++) {
        float through = open ? open[i] : weight, seen = 0.0f;
        __attribute__((opencl_unroll_hint(LAYERS)))
        for (uint n = begin; n < end; n++) {
            seen += through * read(light[n], line_light + n * PIXELS, edge, i, shares + n * READS, past[n]);
            if (n + 1 < LAYERS) through *= 1.0f - read(cover[n], line_cover + n * PIXELS, edge, i, shares + n * READS, past[n]);
        }
        sum[i] += seen;
        if (passed) passed[i] += through;
    }
}

// Whether all pixels that a span reads in layers from `begin` to `end` lie in its planes.
INLINE int is_inside(global const struct spot *spots, const uint begin, const uint end, const int x, const struct layers layers) {
    int inside = 1;
    for (uint n = begin; n < end && EDGES; n++) {
        const int first = x + spots[n].left;
        inside &= first >= 0 && first + PIXELS <= (int)layers.grid_width;
    }
    return inside;
}

#endif
