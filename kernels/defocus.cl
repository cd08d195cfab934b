// Thin-lens defocus by layers of constant blur circle, front to back:
//   light += (1 - seen) * blur(colour in the layer);  seen += (1 - seen) * blur(coverage of the layer)
// and at the end light / seen: where no surface is known, the light of the known ones stands in.
// A blur is the mean over a disk: its area in each row of photosites, read as a difference of running sums.
//
// sampled: (channels, rows, columns) float32 [e- s^-1 um^-2 sr^-1]; layers: (rows, columns) uchar; both with a margin around
//          the frame, their columns starting at a multiple of SEGMENT on the sensor, so that a crop has the same bits.
// sums:    (planes, rows, segments, SEGMENT + 2 reach + 2) float32, running sums of one layer over [-reach, SEGMENT + reach) of
//          each segment, of colour less a base value that stands in the last place: differences of large sums would cost
//          float32 its last digits. Plane CHANNELS is the layer's coverage, 0 or 1 (absent when COVERAGE is 0).
// chords:  (rows_of_disk, 2) float32: whole photosites n on either side of the centre (-1: none), share g of the next one.
// tiles:   (tiles, 2) uint32: segment and first row; TILE_HEIGHT rows each.
// light, seen: (height, width) float32, the frame in the colour of each photosite, and the share of the lens used up so far.
#include "conventions.h"
#include "cfa.h"

// One work-item per row (dimension 0) and plane (dimension 1) of the listed tiles.
kernel void defocus_sums(global const float *restrict sampled, global const uchar *restrict layers, global float *restrict sums,
                         global const uint *restrict tiles, const uint rows, const uint columns, const uint reach,
                         const uint layer) {
    const uint length = SEGMENT + 2 * reach + 2;
    const size_t tile = get_global_id(0) / TILE_HEIGHT, plane = get_global_id(1);
    const size_t segment = tiles[2 * tile], row = tiles[2 * tile + 1] + get_global_id(0) % TILE_HEIGHT;
    global const uchar *mine = layers + row * columns;
    global const float *colour = sampled + (plane * rows + row) * columns;
    global float *sum = sums + ((plane * rows + row) * (columns / SEGMENT) + segment) * length;
    const float base = plane < CHANNELS ? colour[segment * SEGMENT] : 0.0f;
    float running = 0.0f;
    for (int i = 0; i + 1 < (int)length; i++) {
        const int column = (int)(segment * SEGMENT) - (int)reach + i;
        sum[i] = running;
        if (i + 2 < (int)length && column >= 0 && column < (int)columns && mine[column] == layer)
            running += plane < CHANNELS ? colour[column] - base : 1.0f;
    }
    sum[length - 1] = base;
}

INLINE float chord(global const float *sum, const int n, const float g) {
    const float left = sum[-n - 1] + (sum[-n] - sum[-n - 1]) * (1.0f - g);
    const float right = sum[n + 1] + (sum[n + 2] - sum[n + 1]) * g;
    return right - left;
}

// One work-group per row of a tile; dimension 1 is the column's parity, so that a vector of photosites has one colour.
// The barrier in the loop has no data to guard: it makes CPU compilers run the row loop
// outside and the photosites, vectorised, inside.
kernel void defocus_gather(global const float *restrict sums, global float *restrict light, global float *restrict seen,
                           global const uint *restrict tiles, constant float *restrict chords, const uint radius_rows,
                           const float disk_area, const uint rows, const uint columns, const uint reach,
                           const uint margin_x, const uint margin_y, const uint width, const uint height) {
    const size_t tile = get_group_id(2) / TILE_HEIGHT;
    const size_t segment = tiles[2 * tile], row = tiles[2 * tile + 1] + get_group_id(2) % TILE_HEIGHT;
    const size_t length = SEGMENT + 2 * reach + 2, stride = columns / SEGMENT * length;
    const uint column = 2 * get_local_id(0) + get_local_id(1);
    const uint x = segment * SEGMENT + column - margin_x, y = row - margin_y; // wraps to a large number in the margin
    const uint plane = cfa_plane(x, y);
    global const float *sum = sums + (row * (columns / SEGMENT) + segment) * length + reach + column;
    float colour = 0.0f, coverage = 0.0f;
    for (int d = -(int)radius_rows; d <= (int)radius_rows; d++) {
        const int n = (int)chords[2 * (d < 0 ? -d : d)];
        const float g = chords[2 * (d < 0 ? -d : d) + 1];
        global const float *line = sum + ((long)plane * rows + d) * (long)stride;
#if COVERAGE
        const float covered = chord(sum + ((long)CHANNELS * rows + d) * (long)stride, n, g);
#else
        const float covered = 2.0f * ((float)n + g) + 1.0f;
#endif
        colour += chord(line, n, g) + covered * line[length - 1 - reach - column];
        coverage += covered;
        barrier(CLK_LOCAL_MEM_FENCE);
    }
    if (x < width && y < height) {
        const size_t index = (size_t)y * width + x;
#if COVERAGE
        const float through = (1.0f - seen[index]) / disk_area;
        light[index] += through * colour;
        seen[index] += through * coverage;
#else
        light[index] = colour / disk_area;
#endif
    }
}

// light: (pixels) float32, divided by the share of the lens through which some surface was seen.
kernel void defocus_normalise(global float *restrict light, global const float *restrict seen) {
    const size_t index = get_global_id(0);
    light[index] = light[index] / seen[index];
}
