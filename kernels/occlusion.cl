// Lens blur where surfaces occlude each other. The aperture is sampled at points that all photosites of a block share. Through
// each point a photosite sees along a ray, on which the layers are composited front to back:
//   light(x) = mean over points u of sum over layers l of colour_l(x + s_l u) * product over j < l of (1 - coverage_j(x + s_j u))
// A layer is one slab of constant signed blur radius s, or several: the parts of it whose radius lies in one range. A slab is read
// bilinearly at the middle of its range, less the samples whose radius lies outside. Ranges shift from point to point (phase, 0 to
// 1), which averages out the steps between slabs.
// CORRECTION 1: `light` already holds each layer's exact mean over the aperture, composited (defocus.cl). The mean of a product
// differs from the product of means by the covariance of the layers over the aperture; only that is added here.
//
// planes: (LAYERS, CHANNELS + COVERAGE, COLUMN_SETS, sample_rows, set_columns) float32, colours [e- s^-1 um^-2 sr^-1] times
//         coverage, then coverage (0 to 1); interleaved columns, a band with its margins (row_band.h).
// radius: (maps, COLUMN_SETS, sample_rows, set_columns) float32, signed blur radius [photosites], > 0 behind the plane in focus.
// light:  (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1].
// blocks: (blocks, 5) uint32: column within its set and row of the first photosite in the band, first slab, slabs, first point.
// slabs:  (slabs, 6) float32, layer by layer, nearest first: layer, map (-1: constant radius), three radii [photosites]: at phase 0
//         the slab's range goes from the first to the second, at phase 1 from the second to the third; and the slab's class.
// windows: (layers, patch_rows, patch_columns) struct patch_window of the band (patch_windows.cl): slabs that no sample lies in are
//         left out, and where all samples lie in a slab no radius is read.
// points: (points, 5) float32, sets of point_count, MOTION 1: of LAYERS x point_count: u [pupil radii], place from a photosite's centre, phase.
// normalise: 1: light is divided by the share of rays that meet a surface, so that rays that meet none do not darken it.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "patch_windows.h"
#include "plain_math.h"
#include "row_band.h"
#include "slab_light.h"
#define ALL (SETS * SIZE) // photosites of a work-item: SETS sets, each of ROWS rows and SPAN columns of one colour

// Dimension 0: spans of a block; 1: SETS sets of a block's rows, of one colour and so two apart, each as even and odd columns; 2: blocks.
kernel void occlusion(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                      global const uint *restrict blocks, global const float *restrict slabs, global const float *restrict points,
                      global const struct patch_window *restrict windows, const uint patch_rows, const uint point_count,
                      const uint normalise, const struct row_band band) {
    global const uint *block = blocks + 5 * get_global_id(2);
    const size_t column = block[0] + get_global_id(0) * SPAN, next = 2 * OVER * band.set_columns; // to the next row of the colour
    const long set_columns = band.set_columns, plane = (long)band.sample_rows * set_columns, patch_columns = set_columns / HALF_PATCH;
    // Sums over points, of each layer and, last, of all. sum: colour less coverage times `sharp`, for smaller rounding errors; seen: coverage.
    float sum[(LAYERS * CORRECTION + 1) * ALL], seen[(LAYERS * CORRECTION + 1) * ALL], before[ALL], missed[ALL], covered[ALL], sharp[ALL];
    for (uint i = 0; i < (LAYERS * CORRECTION + 1) * ALL; i++) sum[i] = seen[i] = 0.0f;
    size_t start[SETS], colour[SETS]; // of each set: first element of its row in a column set, column sets before its colour's
    for (uint set = 0; set < SETS; set++) {
        const uint number = (uint)get_global_id(1) * SETS + set, parity = number & 1, group = number >> 1;
        const uint row = block[1] + 2 * ROWS * (group / 2) + group % 2;
        start[set] = OVER * (size_t)row * set_columns + column;
        colour[set] = COLUMN_SETS * cfa_plane((uint)((int)parity + band.frame_x), (uint)band.frame_y + row);
        global const float *own = planes + (OVER * parity + colour[set]) * plane + start[set];
        for (uint i = 0; i < SIZE; i++) sharp[set * SIZE + i] = own[i / SPAN * next + i % SPAN];
    }
    float *all = sum + LAYERS * CORRECTION * ALL, *all_seen = seen + LAYERS * CORRECTION * ALL;
    for (uint n = 0; n < point_count; n++) {
        int current = -1;
        for (uint k = block[2], end = k + block[3]; k < end; k++) {
            global const float *slab = slabs + 6 * k;
            const int layer = (int)slab[0], is_mapped = slab[1] >= 0.0f;
            global const float *point = points + 5 * ((size_t)block[4] + n + MOTION * layer * point_count);
            const float low = slab[2] + (slab[3] - slab[2]) * point[4], high = slab[3] + (slab[4] - slab[3]) * point[4];
            const float middle = 0.5f * (low + high), s = !MOTION && middle > -0.5f && middle < 0.5f ? 0.0f : middle; // the blur circle lies inside the photosite
            const float u = OVER * (s * point[0] + point[2] + 0.5f) - 0.5f, v = OVER * (s * point[1] + point[3] + 0.5f) - 0.5f;
            const int dx = whole(u), dy = whole(v);
            const uint down = (OVER * block[1] + (uint)dy) / (OVER * PATCH_ROWS), across = (COLUMN_SETS * block[0] + (uint)dx) / (COLUMN_SETS * HALF_PATCH);
            global const struct patch_window *window = windows + ((size_t)layer * patch_rows + down) * patch_columns + across;
            const float least = is_mapped ? low - 0.25f * (high - low) : -1e30f, most = is_mapped ? high : 1e30f; // overlaps the slab in front, so that slopes show no gaps
            if (!is_met(window, (int)slab[5], least, most)) continue;
            const int fresh = current < 0, partial = COVERAGE && window->filled < 1.0f;
            if (!OPAQUE && layer != current)
                for (uint i = 0; i < ALL; i++) begin_layer(fresh, before + i, missed + i, covered + i);
            current = layer;
            const float f = u - (float)dx, g = v - (float)dy;
            const int mapped = !(window->least >= least && window->greatest < most);
            uint unmet[SPAN];
            for (uint i = 0; i < SPAN; i++) unmet[i] = 0u;
            for (uint set = 0; set < SETS; set++) {
                const int left = OVER * (int)((get_global_id(1) * SETS + set) & 1) + dx;
                const long first = column_set(left) * plane + column_in_set(left), second = column_set(left + 1) * plane + column_in_set(left + 1);
                const long place = first + dy * set_columns + (long)start[set];
                global const float *held = planes + layer * COLUMN_SETS * (CHANNELS + COVERAGE) * plane + place;
                const struct slab_samples at = {held + colour[set] * plane, held + COLUMN_SETS * CHANNELS * plane,
                    radius + (is_mapped ? COLUMN_SETS * (long)slab[1] * plane : 0) + place, second - first, set_columns, next,
                    (1.0f - f) * (1.0f - g), f * (1.0f - g), (1.0f - f) * g, f * g, least, most};
                const size_t of = set * SIZE, own = CORRECTION * layer * ALL + of;
                const struct ray_state ray = {before + of, missed + of, covered + of, all + of, all_seen + of, sum + own, seen + own, unmet, sharp + of};
                add_case(mapped, partial, fresh, at, ray);
            }
            for (uint i = 1; i < SPAN; i++) unmet[0] |= unmet[i];
            if (unmet[0]) continue;
            if (OPAQUE) break; // nothing behind is seen
            while (k + 1 < end && (int)slabs[6 * k + 6] == current) k++; // the ray is fully covered by this layer: skip its other slabs
        }
        if (OPAQUE && current >= 0) for (uint i = 0; i < ALL; i++) all_seen[i] += 1.0f - missed[i];
    }
    for (uint m = 0; m < ALL; m++) {
        const uint set = m / SIZE, i = m % SIZE, number = (uint)get_global_id(1) * SETS + set, group = number >> 1;
        const uint x = (uint)(2 * (column + i % SPAN) + (number & 1)) + (uint)band.frame_x; // wraps
        const uint y = (uint)band.frame_y + block[1] + 2 * ROWS * (group / 2) + group % 2 + 2 * (i / SPAN);
        if (x >= band.width || y >= band.height) continue;
        global float *result = light + (size_t)y * band.width + x;
        const float count = point_count, found = normalise ? (all_seen[m] > 1e-6f ? all_seen[m] : 1e-6f) : count;
#if CORRECTION
        float apart_sum = 0.0f, open = 1.0f; // of the layers' means, composited
        for (uint l = 0; l < LAYERS; l++) {
            apart_sum += open * sum[l * ALL + m];
            open *= 1.0f - seen[l * ALL + m] / count;
        }
        *result += (all[m] - apart_sum) / count + sharp[m] * (all_seen[m] / count - (1.0f - open));
#else
        *result = (all[m] + sharp[m] * all_seen[m]) / found;
#endif
    }
}
