// Thin-lens defocus of one surface: each photosite's mean over the image of the aperture, whose radius may change from
// photosite to photosite.
//   light(x) = sum over nodes of share(radius(x), node) * mean over the aperture's image of that node's radius
// A mean is read from running sums down the columns where the image's weight changes (simulator/defocus/aperture_image.py). Between
// nodes, one `1 / nodes_per_px` apart in signed radius, it is a cubic through the four nearest (Lagrange). ways.h has the order of
// the planes.
//
// sampled: (planes, WAYS, rows, way_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1], a strip with its margin; this surface's
//          colours begin at first_plane.
// sums:    (CHANNELS + COVERAGE, WAYS, rows + 1, way_columns) float32, sums down the columns of what exceeds `least`.
// least:   (CHANNELS + COVERAGE, WAYS, way_columns) float32, least value of each column.
// radius:  (maps, 2, radius_rows, way_columns) float32, signed radius [photosites], > 0 behind the plane in focus.
// light:   (height, width) float32, the mosaic. open: (height, width) float32, share of the light that the layers before let
//          through; COMPOSITE 1 lays this surface behind them, with its mean coverage, plane CHANNELS of it.
// tiles:   (tiles, 4) uint32: first half column and row in the strip, first node, nodes (0: sharp, copied).
// nodes:   (nodes, 6) int32: first tap, taps, first side, sides, radius in steps of 1 / nodes_per_px, whether taps are read from
//          `sampled` itself; counts are multiples of 8.
// taps:    (2, all taps) int32, distance in `sums` for an even and an odd photosite; weights: (all taps) float32.
// sides:   (2, all sides) int32, distance in `least`; totals: (all sides) float32.
// corners: where the pupil changes over the field (zones.h), (tiles, 2, TILE_ZONES + 1) uint32: where a corner's list begins in
//          entries: int32, the place in `nodes` of each node that tiles name. first_row: row of the strip where zones begin.
// margin_x, margin_y: place of the frame's first photosite in the strip; strip_y: row of the frame at the strip's first row.
#include "conventions.h"
#include "aperture_mean.h"
#include "cfa.h"
#include "ways.h"
#include "zones.h"

kernel void defocus_sums(global const float *restrict sampled, global float *restrict sums, global float *restrict least,
                         const uint first_plane, const uint rows, const uint way_columns) {
    const size_t plane = get_global_id(1), first = get_global_id(0) * SPAN;
    global const float *value = sampled + (WAYS * first_plane + plane) * rows * way_columns + first;
    global float *sum = sums + plane * (rows + 1) * way_columns + first;
    float low[SPAN], running[SPAN];
    for (uint i = 0; i < SPAN; i++) low[i] = value[i];
    for (uint row = 1; row < rows; row++)
        for (uint i = 0; i < SPAN; i++) low[i] = value[row * way_columns + i] < low[i] ? value[row * way_columns + i] : low[i];
    for (uint i = 0; i < SPAN; i++) {
        least[plane * way_columns + first + i] = low[i];
        running[i] = 0.0f;
    }
    for (uint row = 0; row < rows; row++)
        for (uint i = 0; i < SPAN; i++) {
            sum[row * way_columns + i] = running[i];
            running[i] += value[row * way_columns + i] - low[i];
        }
    for (uint i = 0; i < SPAN; i++) sum[rows * way_columns + i] = running[i];
}

// Dimension 0: spans of a tile; 1: its rows, each as even and odd columns; 2: tiles.
kernel void defocus_mean(global const float *restrict sampled, global const float *restrict sums, global const float *restrict least,
                         global const float *restrict radius, global float *restrict light, global float *restrict open,
                         global const uint *restrict tiles, global const int *restrict nodes, global const int *restrict taps,
                         global const float *restrict weights, global const int *restrict sides, global const float *restrict totals,
                         global const uint *restrict corners, global const int *restrict entries, const uint first_row,
                         const uint all_taps, const uint all_sides, const float nodes_per_px,
                         const uint first_plane, const uint map, const uint rows, const uint way_columns, const uint radius_rows,
                         const uint radius_row, const uint margin_x, const uint strip_y, const uint margin_y, const uint width,
                         const uint height) {
    const size_t parity = get_global_id(1) & 1;
    global const uint *tile = tiles + 4 * get_global_id(2);
    const uint row = tile[1] + (uint)(get_global_id(1) >> 1), y = strip_y + row - margin_y;
    const size_t column = tile[0] + get_global_id(0) * SPAN;
    if (y >= height) return;
    const size_t colour = WAYS * cfa_plane(parity + margin_x, y); // the margin's parity moves the pattern
    global const float *own = radius + ((2 * map + parity) * radius_rows + radius_row + row) * way_columns + column;
    global const float *sharp = sampled + ((WAYS * first_plane + colour + parity) * rows + row) * way_columns + column;
    float sum[2 * SPAN], mean[SPAN]; // colour, and coverage
    for (uint i = 0; i < SPAN; i++) sum[i] = tile[3] ? 0.0f : sharp[i]; // only where OVER is 1
    for (uint i = SPAN; i < 2 * SPAN; i++) sum[i] = 0.0f;
    const uint first_x = 2 * (uint)(column - tile[0]) + (uint)parity; // in the tile
    const float down = zone_place(row - first_row);
    for (uint corner = 0; corner < CORNERS; corner++) {
        global const int *places = entries + zone_corner(corners, get_global_id(2), corner, first_x);
        for (int n = (int)tile[2]; n < (int)(tile[2] + tile[3]); n++) {
            global const int *node = nodes + 6 * (ZONE ? places[n] : n);
            for (uint what = 0; what <= COMPOSITE; what++) {
                const size_t plane = what ? WAYS * CHANNELS : colour;
                global const float *values = sampled + ((WAYS * first_plane + plane) * rows + OVER * row) * way_columns + column;
                global const float *line = node[5] ? values : sums + (plane * (rows + 1) + OVER * row) * way_columns + column;
                global const float *low = least + plane * way_columns + column;
                for (uint i = 0; i < SPAN; i++) mean[i] = 0.0f;
                add_taps(line, taps + parity * all_taps + node[0], weights + node[0], node[1], mean);
                add_taps(low, sides + parity * all_sides + node[2], totals + node[2], node[3], mean);
                for (uint i = 0; i < SPAN; i++)
                    sum[what * SPAN + i] += corner_share(corner, zone_place(first_x + 2 * i), down) *
                        (NODES ? share(own[i] * nodes_per_px, node[4], nodes_per_px) : 1.0f) * mean[i];
            }
        }
    }
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) - margin_x; // wraps to a large number in the margin
        if (x >= width) continue;
#if COMPOSITE
        const float through = open[(size_t)y * width + x];
        light[(size_t)y * width + x] += through * sum[i];
        open[(size_t)y * width + x] = through * (1.0f - sum[SPAN + i]);
#else
        light[(size_t)y * width + x] = sum[i];
#endif
    }
}
