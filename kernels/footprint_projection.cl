// Projection of a scene whose pixels are even squares, or whose light is bilinear between them, where each sample of light averages it
// over several squares (simulator/optics/geometry/footprint.py): first across, at the columns of samples, then down. The host lists the
// pixels that are read along either axis. Beyond the scene's grid its edge pixels continue.
//
// planes:  (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// across:  (channels, COLUMN_SETS, scene_rows, set_columns) float32, scene rows from first_row on, samples in interleaved columns.
// column_starts, row_starts: first pixel that a column or a row of samples reads; all lie in the rows of `across` or beyond the grid.
// column_shares: (channels, READS, COLUMN_SETS set_columns) float32, row_shares: (channels, READS, rows) float32: shares of the pixels
// from it on, with the sum 1.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "plain_math.h"

// Dimension 0: spans of columns of a set; 1: scene rows; 2: column sets of all channels.
kernel void footprint_across(global const float *restrict planes, global float *restrict across, global const int *restrict column_starts,
                             global const float *restrict column_shares, const uint scene_width, const uint scene_height,
                             const uint first_row) {
    const size_t columns = SPAN * get_global_size(0), set = get_global_id(2), first = SPAN * get_global_id(0);
    global const float *line = planes + (set / COLUMN_SETS * scene_height + first_row + get_global_id(1)) * scene_width;
    global const float *shares = column_shares + set / COLUMN_SETS * (READS * COLUMN_SETS * columns) + COLUMN_SETS * first + set % COLUMN_SETS;
    global const int *starts = column_starts + COLUMN_SETS * first + set % COLUMN_SETS;
    global float *to = across + row_start(set, get_global_id(1), get_global_size(1), columns) + first;
    HEAD_LANES
    for (uint n = 0; n < SPAN; n++) {
        const int start = starts[COLUMN_SETS * n];
        const float own = line[clamped(start + READS / 2, scene_width)];
        float more = 0.0f; // than `own`, so that even light stays even
        __attribute__((opencl_unroll_hint(READS)))
        for (int i = 0; i < READS; i++)
            more += shares[COLUMN_SETS * (columns * i + n)] * (line[clamped(start + i, scene_width)] - own);
        to[n] = own + more;
    }
}

// Light of one sample, of a column set of a channel.
INLINE float footprint_down(global const float *across, global const int *row_starts, global const float *row_shares, const size_t set,
                            const size_t row, const size_t rows, const size_t column, const size_t columns, const uint scene_height,
                            const uint first_row, const uint scene_rows) {
    global const float *lines = across + row_start(set, 0, scene_rows, columns) + column;
    global const float *shares = row_shares + set / COLUMN_SETS * (READS * rows) + row;
    const int start = row_starts[row];
    const float own = lines[columns * (size_t)(clamped(start + READS / 2, scene_height) - (int)first_row)];
    float more = 0.0f;
    __attribute__((opencl_unroll_hint(READS)))
    for (int j = 0; j < READS; j++)
        more += shares[rows * j] * (lines[columns * (size_t)(clamped(start + j, scene_height) - (int)first_row)] - own);
    return own + more;
}

// sampled: (planes, COLUMN_SETS, rows, set_columns) float32, of which the first rows are written, from first_plane on. Dimension 0: columns
// of a set; 1: rows of samples that are written; 2: column sets of all channels.
kernel void footprint_planes(global const float *restrict across, global float *restrict sampled, global const int *restrict row_starts,
                             global const float *restrict row_shares, const uint first_plane, const uint rows,
                             const uint scene_height, const uint first_row, const uint scene_rows) {
    const size_t columns = get_global_size(0), set = get_global_id(2);
    sampled[row_start(COLUMN_SETS * first_plane + set, get_global_id(1), rows, columns) + get_global_id(0)] =
        footprint_down(across, row_starts, row_shares, set, get_global_id(1), get_global_size(1), get_global_id(0), columns, scene_height,
                       first_row, scene_rows);
}

// mosaic: (height, width) float32, each photosite's own colour, written from mosaic_row on, of one sample per photosite. Dimension 0:
// columns of a set; 1: rows of photosites; 2: column sets of one plane.
kernel void footprint_mosaic(global const float *restrict across, global float *restrict mosaic, global const int *restrict row_starts,
                             global const float *restrict row_shares, const uint mosaic_row, const uint width, const uint scene_height,
                             const uint first_row, const uint scene_rows) {
    const size_t column = COLUMN_SETS * get_global_id(0) + get_global_id(2), row = mosaic_row + get_global_id(1);
    const size_t set = COLUMN_SETS * cfa_plane((uint)column, (uint)row) + get_global_id(2);
    if (column >= width) return;
    mosaic[row * width + column] =
        footprint_down(across, row_starts, row_shares, set, get_global_id(1), get_global_size(1), get_global_id(0), get_global_size(0),
                       scene_height, first_row, scene_rows);
}
