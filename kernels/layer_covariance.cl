// Covariance over the aperture of two layers at rest, each of one blur radius around a block. `light` holds the exact mean of each layer over the
// aperture, composited (defocus.cl). The nearer layer's coverage c and the light L behind it vary together from point to point, so that
//   mean((1 - c) L) = (1 - mean(c)) mean(L) - (mean(c L) - mean(c) mean(L))
// of which the last bracket is subtracted here: occlusion.cl with CORRECTION 1, whose light of the nearer layer cancels, with sums in registers.
//
// planes, light, blocks, slabs, points: as in occlusion.cl; each block has two slabs of constant radius, that of the nearer layer first.
#include "conventions.h"
#include "agreement.h"
#include "block_view.h"
#include "interleaved_columns.h"
#include "layer_pair.h"
#include "mosaic_colors.h"
#include "row_band.h"
#include "slab_list.h"

// Dimension 0: spans of a block; 1: pairs of rows of a block, ROWS of them; 2: blocks. A work-item computes SETS sets of photosites.
kernel void layer_covariance(global const float *restrict planes, global float *restrict light, global const uint *restrict blocks,
                             global const float *restrict slabs, global const float *restrict points, const struct sampling sampling,
                             const struct row_band band) {
    global const uint *block = blocks + BLOCK * get_global_id(2);
    global const float *near = slabs + slab_element(block[2]), *far = near + 1, *first_point = points + POINT * (size_t)block[4];
    const long set_columns = band.set_columns, plane = (long)band.sample_rows * set_columns, next = 2 * OVER * set_columns, channels = band.channels;
    const uint top = block[1] + 2 * ROWS * (uint)get_global_id(1); // first row
    const long start = OVER * (long)top * set_columns + (long)(block[0] + get_global_id(0) * SPAN); // of the first photosite in its column set
    global const float *coverage = planes + ((long)near[0] * (channels + 1) + channels) * COLUMN_SETS * plane + start;
    global const float *before[PLANES], *behind[PLANES]; // light of both layers
    for (uint i = 0; i < PLANES; i++) {
        const long colour = COLORS > 1 ? sampling.first_color + i : band_color(i, top + i / 2, band);
        before[i] = planes + ((long)near[0] * (channels + 1) + colour) * COLUMN_SETS * plane + start;
        behind[i] = planes + ((long)far[0] * (channels + 1) + colour) * COLUMN_SETS * plane + start;
    }
    float cover[ALL], sum[COLORS * ALL], both[COLORS * ALL], sharp[COLORS * ALL], own[COLORS * ALL], kept[COLORS * ALL];
    const struct pair_sums sums = {cover, sum, both};
    local float parts[WORKERS]; // of a sum over the block
    for (uint part = 0; part < COLORS * ROWS * SETS; part++) { // spans of a set
        const uint set = part % SETS, first = part * SPAN;
        const long element = set % 2 * OVER * plane + OVER * (long)(set / 2) * set_columns + part / SETS % ROWS * next;
        for (uint i = 0; i < SPAN; i++) {
            cover[(first + i) % ALL] = sum[first + i] = both[first + i] = kept[first + i] = 0.0f;
            sharp[first + i] = behind[of_color(first / ALL, set)][element + i];
            own[first + i] = before[of_color(first / ALL, set)][element + i];
        }
    }
    uint agreed = 0;
    for (uint n = 0, end = sampling.least; n < sampling.point_count && agreed + 1u != 1u << COLORS; n = end, end *= 2u) {
        for (; n < end; n += BATCH_POINTS) add_points(sums, sharp, coverage, behind, first_point + POINT * n, block, near[2 * SLAB_GROUP], far[2 * SLAB_GROUP], band);
        if (end == sampling.point_count) continue;
        for (uint c = 0; c < COLORS; c++) { // `kept` is what a colour found whose rays agree, whatever rays others take
            if (agreed >> c & 1u) continue;
            const float off = sum_over_block(disagreement(sums, c, sharp, own, kept, end, sampling), parts);
            if (end > sampling.least && off <= (float)(WORKERS * ALL)) agreed |= 1u << c;
        }
    }
    for (uint part = 0; part < COLORS * ROWS * SETS; part++) {
        const uint c = part / (ROWS * SETS), set = part % SETS, first = part * SPAN;
        const uint x = 2 * (block[0] + (uint)get_global_id(0) * SPAN) + set % 2 + (uint)band.frame_x; // wraps left of the frame
        const uint y = (uint)band.frame_y + top + set / 2 + 2 * (part / SETS % ROWS);               // wraps above it
        if (y >= band.height) continue;
        global float *to = light + mosaic_element(c, 0, y, band);
        for (uint i = 0; i < SPAN; i++) {
            const float found = agreed >> c & 1u ? kept[first + i] : covariance(sums, c, (first + i) % ALL, (float)sampling.point_count);
            const uint column = x + 2 * i; // of the frame
            if (column < band.width) set_light(to + column, 1, -found);
        }
    }
}
