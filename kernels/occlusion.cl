// Lens blur where surfaces occlude each other. The aperture is sampled at points that all photosites of a block share. Through
// each point a photosite sees along a ray, on which the layers are composited front to back:
//   light(x) = mean over points u of sum over layers l of colour_l(x + s_l u) * product over j < l of (1 - coverage_j(x + s_j u))
// A layer is one slab of constant signed blur radius s, or several: the parts of it whose radius lies in one range. A slab is read
// bilinearly at the middle of its range, less the samples whose radius lies outside. Ranges shift with the point's phase, so that no steps show.
// CORRECTION 1: `light` already holds each layer's exact mean over the aperture, composited (defocus.cl). The mean of a product
// differs from the product of means by the covariance of the layers over the aperture; only that is added here.
//
// planes: (LAYERS, channels + COVERAGE, COLUMN_SETS, sample_rows, set_columns) float32, colours [e- s^-1 um^-2 sr^-1] times
//         coverage, then coverage (0 to 1); interleaved columns, a band with its margins (row_band.h).
// radius: (maps, COLUMN_SETS, sample_rows, set_columns) float32, signed blur radius [photosites], > 0 behind the plane in focus.
// light:  (mosaics, height, width) float32, of mosaic_colors.h.
// blocks: (blocks, BLOCK) uint32: column within its set and row of the first photosite in the band, first slab, slabs, first point; TURNS 1: and
//         columns and rows of that photosite's middle from the middle of its cell, as the bits of a float32.
// slabs:  (groups, 6, SLAB_GROUP) float32 (slab_list.h), layer by layer, nearest first: layer, map (-1: constant radius), three radii [photosites]: at phase 0
//         the slab's range goes from the first to the second, at phase 1 from the second to the third; and the slab's class.
// windows: (layers, patch_rows, patch_columns) struct patch_window of the band (patch_windows.cl): slabs that no sample lies in are
//         left out, and where all samples lie in a slab no radius is read.
// points: (points, POINT) float32, sets of point_count, MOTION 1: of LAYERS x point_count: u in x and y [pupil radii], x and y in the
// photosite from its centre, phase; GROWS 1: and what is added to the first four from one pair of rows of a block to the next; TURNS 1: per photosite to
// the right, down, and both, from the middle of a cell on. A block takes the first points of its set until its photosites agree (agreement.h).
#include "conventions.h"
#include "agreement.h"
#include "block_view.h"
#include "interleaved_columns.h"
#include "mosaic_colors.h"
#include "patch_windows.h"
#include "plain_math.h"
#include "point_sums.h"
#include "row_band.h"
#include "slab_heads.h"
#include "slab_list.h"
#include "slab_rows.h"

// Dimension 0: spans of a block; 1: pairs of rows of a block, ROWS of them; 2: blocks. A work-item computes SETS sets of photosites.
kernel void occlusion(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                      global const uint *restrict blocks, global const float *restrict slabs, global const float *restrict points,
                      global const struct patch_window *restrict windows, const struct sampling sampling, const struct row_band band) {
    global const uint *block = blocks + BLOCK * get_global_id(2);
    const size_t column = block[0] + get_global_id(0) * SPAN, next = 2 * OVER * band.set_columns; // to the next row of the colour
    const long set_columns = band.set_columns, plane = (long)band.sample_rows * set_columns;
    float sum[CORRECTION ? COLORS * LAYERS * ALL : 1], seen[CORRECTION ? LAYERS * ALL : 1], all[COLORS * ALL], all_seen[ALL];
    float before[ALL], missed[ALL], covered[ALL], sharp[COLORS * ALL], kept[COLORS * ALL];
    const struct point_sums sums = {sum, seen, all, all_seen};
    local float parts[WORKERS]; // of a sum over the block
    for (uint i = 0; i < COLORS * LAYERS * CORRECTION * ALL; i++) sum[i] = seen[i % (LAYERS * ALL)] = 0.0f;
    uint agreed = 0, top = block[1] + 2 * ROWS * (uint)get_global_id(1); // first row
    const long start = OVER * (long)top * set_columns + (long)column; // of the first photosite in its column set
    long colour[PLANES]; // column sets before each colour's
    for (uint i = 0; i < PLANES; i++)
        colour[i] = COLUMN_SETS * (COLORS > 1 ? sampling.first_color + i : band_color(i, top + i / 2, band));
    for (uint m = 0; m < COLORS * ALL; m++) {
        const uint set = m % ALL / SIZE, i = m % SIZE;
        all[m] = all_seen[m % ALL] = kept[m] = 0.0f;
        const float own = planes[(OVER * (set % 2) + colour[of_color(m / ALL, set)]) * plane + start + OVER * (long)(set / 2) * set_columns + i / SPAN * next + i % SPAN];
        sharp[m] = smaller(own, sampling.brightest);
    }
    for (uint n = 0; n < sampling.point_count && agreed + 1u != 1u << COLORS; n++) {
        int current = -1; // layer
        uint open[ROWS], begun[ROWS] = {0u}, left = 1u; // left: whether any ray is
        for (uint j = 0; j < ROWS; j++) open[j] = 1u;
        for (uint first = block[2], end = first + block[3]; first < end && (left | (OPAQUE ^ 1u)); first += HEADS) { // OPAQUE: until no ray is left
            struct slab_heads heads;
            find_slabs(&heads, first, end, n, block, slabs, points, windows, start, sampling, band);
            for (uint h = 0; h < HEADS && first + h < end && (left | (OPAQUE ^ 1u)); h++) {
                global const float *slab = slabs + slab_element(first + h);
                const int layer = (int)slab[0], map = (int)slab[SLAB_GROUP], is_mapped = map >= 0;
                if (!heads.met[h] || (!left && layer == current)) continue; // or rays are fully covered by this layer
                global const float *point = point_of(points, block, n, layer, sampling);
                global const struct patch_window *window = windows + heads.window[h];
                const float least = heads.least[h], most = heads.most[h], s = heads.radius[h];
                const struct block_view view = view_block(point, block, s, start, band);
                const int dx = view.dx, dy = view.dy, partial = COVERAGE && !(view.held && window->filled >= 1.0f);
                if (!OPAQUE && layer != current) {
                    for (uint i = 0; i < ALL; i++) begin_layer(current < 0, before + i, missed + i, covered + i);
                    for (uint j = 0; j < ROWS; j++) open[j] = 1u;
                }
                current = layer;
                const float past = GROWS ? (float)(int)(get_global_id(1) * ROWS) - 0.5f * (float)(int)(get_global_size(1) * ROWS - 1) : 0.0f;
                const float right = GROWS ? OVER * (s * point[5] + point[7]) : 0.0f, below = GROWS ? OVER * (s * point[6] + point[8]) : 0.0f;
                const float f = view.x - (float)dx + past * right, g = view.y - (float)dy + past * below;
                const int mapped = is_mapped && !(view.held && window->least >= least && window->greatest < most);
                global const float *held = planes + layer * COLUMN_SETS * (long)(band.channels + COVERAGE) * plane + start;
                struct slab_samples at = {{held}, held + COLUMN_SETS * (long)band.channels * plane, radius + (is_mapped ? COLUMN_SETS * (long)map * plane : 0) + start,
                    {dy * set_columns, (dy + 1) * set_columns, (dy + OVER) * set_columns, (dy + OVER + 1) * set_columns},
                    {column_start(dx, plane), column_start(dx + 1, plane), column_start(dx + OVER, plane), column_start(dx + OVER + 1, plane)}, next,
                    bilinear_weights(f, g), least, most, s, OVER * view.u_x, OVER * view.u_y, f, g, right, below, view, set_columns, band.sample_rows};
                set_planes(at.light, held, colour, plane);
                const struct ray_state ray = {before, missed, covered, all, all_seen, sum + CORRECTION * layer * ALL, seen + CORRECTION * layer * ALL, open, begun, sharp};
                add_case(mapped, partial, at, ray);
                left = 0u;
                for (uint j = 0; j < ROWS; j++) left |= open[j];
            }
        }
        if (OPAQUE) add_seen(begun, missed, all_seen);
        if (n + 1 < sampling.least || n + 1 == sampling.point_count || (n & (n + 1)) != 0) continue;
        for (uint c = 0; c < COLORS; c++) { // `kept` is what a colour found whose rays agree, whatever rays others take
            if (agreed >> c & 1u) continue;
            const float off = sum_over_block(disagreement(sums_of(sums, c), sharp + c * ALL, kept + c * ALL, n + 1, sampling), parts);
            if (n + 1 > sampling.least && off <= (float)(WORKERS * ALL)) agreed |= 1u << c;
        }
    }
    for (uint m = 0; m < COLORS * ALL; m++) {
        const uint c = m / ALL, set = m % ALL / SIZE, i = m % SIZE;
        const uint x = (uint)(2 * (column + i % SPAN) + set % 2) + (uint)band.frame_x, y = (uint)band.frame_y + top + set / 2 + 2 * (i / SPAN); // wrap
        if (x >= band.width || y >= band.height) continue;
        const float found = agreed >> c & 1u ? kept[m] : found_light(sums_of(sums, c), m % ALL, sharp[m], sampling.point_count, sampling.normalise);
        set_light(light + mosaic_element(c, x, y, band), CORRECTION, found);
    }
}
