// Thin-lens defocus of one surface. The light of a photosite is the mean over the image of the aperture, whose signed radius may
// change from photosite to photosite. That mean is tabulated at nodes 1 / NODES_PER_PX apart in radius and interpolated:
//   light(x) = sum over nodes n of node_weight(radius(x), n) * mean over the aperture's image of node n's radius
// A node's mean is a sum of taps. Most are differences of running sums down the columns, between rows where the image's weights
// change (simulator/optics/defocus/aperture_kernel.py); small images are read from the samples themselves.
//
// sampled: (planes, COLUMN_SETS, sample_rows, set_columns) float32, electron radiance [e- s^-1 um^-2 sr^-1] times coverage, and with
//          COVERAGE 1 one plane of coverage (0 to 1) after the colours; interleaved columns, a band with its margins.
// sums:    (channels + COVERAGE, COLUMN_SETS, sample_rows + 1, set_columns) float32, of this surface: sum of all samples above the row
//          in its column. Rounding errors do not add up (Kahan).
// radius:  (maps, 2, map_rows, set_columns) float32, signed blur radius [photosites], > 0 behind the plane in focus; OVER 1.
// light:   (mosaics, height, width) float32, of mosaic_colors.h.
// open:    (mosaics, height, width) float32, share of light that the nearer surfaces let through. COMPOSITE 1: this surface is composited
//          behind them, and `open` is multiplied by one minus its mean coverage. COMPOSITE 0: not read.
// tiles:   (tiles) struct tile (mean_tile.h). nodes: (nodes) struct node, taps: (taps) struct tap, of all nodes (aperture_mean.h).
// corners: (tiles, 2, TILE_ZONES + 1) uint32, first place in `entries` of each corner of a tile's zones (zones.h); ZONE 0: not read.
// entries: (corners, nodes that tiles name) int32, place in `nodes` of the node that holds at that corner; ZONE 0: not read.
#include "conventions.h"
#include "aperture_mean.h"
#include "interleaved_columns.h"
#include "mean_tile.h"
#include "mosaic_colors.h"
#include "row_band.h"
#include "zones.h"

struct surface {
    uint first_plane; // of `sampled`
    uint map;         // of `radius`
    uint map_rows;    // rows of photosites of each map
    uint map_row;     // row of the map at the band's first row
    uint first_color; // of mosaic_colors.h
    uint zone_row;    // row of photosites of the band at which a row of zones begins
};

// Dimension 0: spans of SPAN columns of a set; 1: column sets of all planes.
kernel void defocus_sums(global const float *restrict sampled, global float *restrict sums, const uint first_plane,
                         const struct row_band band) {
    const size_t set = get_global_id(1), first = get_global_id(0) * SPAN, rows = band.sample_rows, columns = band.set_columns;
    global const float *value = sampled + row_start(COLUMN_SETS * first_plane + set, 0, rows, columns) + first;
    global float *sum = sums + row_start(set, 0, rows + 1, columns) + first;
    float running[SPAN], lost[SPAN]; // lost: by which the running sum is too large
    for (uint i = 0; i < SPAN; i++) running[i] = lost[i] = 0.0f;
    for (size_t row = 0; row < rows; row++)
        for (uint i = 0; i < SPAN; i++) {
            sum[row * columns + i] = running[i];
            add_kept(value[row * columns + i], running + i, lost + i);
        }
    for (uint i = 0; i < SPAN; i++) sum[rows * columns + i] = running[i];
}

// Dimension 0: spans of a tile; 1: its rows of photosites, each as even and odd columns; 2: tiles.
kernel void defocus_mean(global const float *restrict sampled, global const float *restrict sums, global const float *restrict radius,
                         global float *restrict light, global float *restrict open, global const struct tile *restrict tiles, global const struct node *restrict nodes,
                         global const struct tap *restrict taps, global const uint *restrict corners, global const int *restrict entries,
                         const struct surface surface, const struct row_band band) {
    const size_t parity = get_global_id(1) & 1, rows = band.sample_rows, columns = band.set_columns;
    const struct tile tile = tiles[get_global_id(2)];
    const uint row = tile.row + (uint)(get_global_id(1) >> 1), y = (uint)band.frame_y + row; // y wraps above the frame
    const size_t column = tile.column + get_global_id(0) * SPAN;
    if (y >= band.height) return;
    const size_t first = COLUMN_SETS * surface.first_plane, map = 2 * surface.map + parity;
    const size_t colour = COLUMN_SETS * (COLORS > 1 ? surface.first_color : band_color((uint)parity, row, band));
    global const float *own = radius + row_start(map, surface.map_row + row, surface.map_rows, columns) + column;
    global const float *sharp = sampled + row_start(first + colour + parity, row, rows, columns) + column;
    float sum[(COLORS + 1) * SPAN], mean[SPAN], share[SPAN]; // sum: of each colour, and of coverage
    for (uint i = 0; i < (COLORS + 1) * SPAN; i++) // tiles are copied only where OVER is 1
        sum[i] = tile.nodes || i >= COLORS * SPAN ? 0.0f : sharp[i / SPAN * COLUMN_SETS * rows * columns + i % SPAN];
    const uint first_x = 2 * (uint)(column - tile.column) + (uint)parity; // column of photosites in the tile
    const float down = zone_place(row - surface.zone_row);
    for (uint corner = 0; corner < CORNERS; corner++) {
        global const int *places = entries + zone_corner(corners, get_global_id(2), corner, first_x);
        for (uint n = tile.first_node; n < tile.first_node + tile.nodes; n++) {
            const struct node node = nodes[ZONE ? places[n] : (int)n];
            uint counts = 0u; // whether the node does for any photosite
            for (uint i = 0; i < SPAN; i++) {
                const float between = NODES ? node_weight(own[i] * NODES_PER_PX, node.radius) : 1.0f;
                share[i] = is_left_out(tile, first_x + 2 * i, row - tile.row) ? 0.0f : between * corner_share(corner, zone_place(first_x + 2 * i), down);
                counts |= share[i] != 0.0f ? 1u : 0u;
            }
            if (!counts) continue;
            for (uint what = 0; what < COLORS + COMPOSITE; what++) {
                const size_t set = what == COLORS ? COLUMN_SETS * (size_t)band.channels : colour + COLUMN_SETS * what;
                global const float *values = sampled + row_start(first + set, OVER * row, rows, columns) + column;
                global const float *summed = sums + row_start(set, OVER * row, rows + 1, columns) + column;
                for (uint i = 0; i < SPAN; i++) mean[i] = 0.0f;
                add_image(node, values, summed, taps, parity, mean);
                for (uint i = 0; i < SPAN; i++) sum[what * SPAN + i] += share[i] * mean[i];
            }
        }
    }
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) + (uint)band.frame_x; // wraps to a large number left of the frame
        if (x >= band.width || is_left_out(tile, first_x + 2 * i, row - tile.row)) continue;
        const size_t at = mosaic_element(0, x, y, band); // mosaics that are made together share the first one's `open`
        const float through = COMPOSITE ? open[at] : 1.0f;
        for (uint c = 0; c < COLORS; c++)
            set_light(light + mosaic_element(c, x, y, band), COMPOSITE, through * sum[c * SPAN + i]);
        if (COMPOSITE) open[at] = through * (1.0f - sum[COLORS * SPAN + i]);
    }
}
