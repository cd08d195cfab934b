// Thin-lens defocus by layers of constant blur circle, front to back:
//   light += (1 - seen) * blur(colour in the layer);  seen += (1 - seen) * blur(coverage of the layer)
// and at the end light / seen: where no surface is known, the light of the known ones stands in. `light` is kept as the
// difference to the sharp picture times `seen`, so that rounding cannot add up where the blur changes nothing.
// A blur is the mean over a disk: its area in each row of photosites, read as a difference of running sums.
//
// sampled: (channels, rows, columns) float32 [e- s^-1 um^-2 sr^-1]; layers: (rows, columns) uchar; both with a margin around
//          the frame, their columns starting at a multiple of SEGMENT on the sensor, so that a crop has the same bits.
// sums:    (planes, rows, segments, SEGMENT + 2 reach + 2) float32, running sums of one layer over [-reach, SEGMENT + reach) of
//          each segment, of colour less a base value that stands in the last place: differences of large sums would cost
//          float32 its last digits. Plane CHANNELS is the layer's coverage, 0 or 1 (absent when COVERAGE is 0).
// chords:  (disk_rows, 2) float32: whole photosites n on either side of the centre (-1: none), share g of the next one.
// tiles:   (tiles, 2) uint32: segment and first row; the launch has the tiles' rows as a dimension.
// light, seen: (height, width) float32, the frame in the colour of each photosite, and the share of the lens used up so far.
#include "conventions.h"
#include "cfa.h"

// One work-item per row of a tile (dimension 0), plane (1) and listed tile (2).
kernel void defocus_sums(global const float *restrict sampled, global const uchar *restrict layers, global float *restrict sums,
                         global const uint *restrict tiles, const uint rows, const uint columns, const uint reach,
                         const uint layer) {
    const uint length = SEGMENT + 2 * reach + 2;
    const size_t plane = get_global_id(1), tile = get_global_id(2);
    const size_t segment = tiles[2 * tile], row = tiles[2 * tile + 1] + get_global_id(0);
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

// One work-group per row of a tile (dimension 1) and tile (2); within it dimension 1 is the column's parity, so that a vector
// of photosites has one colour.
// The barrier in the loop has no data to guard: it makes CPU compilers run the row loop outside and the photosites,
// vectorised, inside.
kernel void defocus_gather(global const float *restrict sums, global const float *restrict sampled, global float *restrict light,
                           global float *restrict seen,
                           global const uint *restrict tiles, constant float *restrict chords, const uint disk_rows,
                           const float disk_area, const uint rows, const uint columns, const uint reach,
                           const uint margin_x, const uint margin_y, const uint width, const uint height) {
    const size_t tile = get_group_id(2);
    const uint y = tiles[2 * tile + 1] + get_group_id(1) - margin_y; // wraps to a large number in the margin
    const size_t segment = tiles[2 * tile], row = (y < height ? y : 0) + margin_y; // a row of the margin has no disk to read
    const size_t length = SEGMENT + 2 * reach + 2, stride = columns / SEGMENT * length;
    const uint column = 2 * get_local_id(0) + get_local_id(1);
    const uint x = segment * SEGMENT + column - margin_x;
    const uint plane = cfa_plane(x, y);
    global const float *sum = sums + (row * (columns / SEGMENT) + segment) * length + reach + column;
    const float sharp = sampled[(plane * rows + row) * columns + segment * SEGMENT + column];
    float colour = 0.0f, coverage = 0.0f; // colour: its difference to the sharp picture
    uint first = 0, last = disk_rows;
#if COVERAGE
    // rows where this segment holds nothing of the layer add nothing; the last running sum tells
    global const float *total = sums + (((long)CHANNELS * rows + row - disk_rows / 2) * (columns / SEGMENT) + segment + 1) * length - 2;
    while (first < last && total[first * stride] == 0.0f) first++;
    while (first < last && total[(last - 1) * stride] == 0.0f) last--;
#endif
    for (uint disk_row = first; disk_row < last; disk_row++) {
        const int n = (int)chords[2 * disk_row];
        const float g = chords[2 * disk_row + 1];
        const long offset = (long)stride * ((long)disk_row - (long)(disk_rows / 2));
        global const float *line = sum + (long)plane * rows * stride + offset;
#if COVERAGE
        const float covered = chord(sum + (long)CHANNELS * rows * stride + offset, n, g);
#else
        const float covered = 2.0f * ((float)n + g) + 1.0f;
#endif
        colour += chord(line, n, g) + covered * (line[length - 1 - reach - column] - sharp);
        coverage += covered;
        barrier(CLK_LOCAL_MEM_FENCE);
    }
    if (x < width && y < height && first < last) {
        const size_t index = (size_t)y * width + x;
#if COVERAGE
        const float through = (1.0f - seen[index]) / disk_area;
        light[index] += through * colour;
        seen[index] += through * coverage;
#else
        light[index] = sharp + colour / disk_area;
#endif
    }
}

// One work-item per photosite of the frame: nothing seen yet.
kernel void defocus_clear(global float *restrict light, global float *restrict seen) {
    light[get_global_id(0)] = 0.0f;
    seen[get_global_id(0)] = 0.0f;
}

// One work-item per photosite of the frame: light becomes the blurred picture.
kernel void defocus_normalise(global const float *restrict sampled, global float *restrict light, global const float *restrict seen,
                              const uint rows, const uint columns, const uint margin_x, const uint margin_y) {
    const size_t x = get_global_id(0), y = get_global_id(1), index = y * get_global_size(0) + x;
    const size_t plane = cfa_plane(x, y);
    light[index] = sampled[(plane * rows + y + margin_y) * columns + x + margin_x] + light[index] / seen[index];
}
