// Lens blur where surfaces occlude each other. The aperture is sampled at points that all photosites of a block share. Through
// each point a photosite sees along a ray, on which the layers are composited front to back:
//   light(x) = mean over points u of sum over layers l of colour_l(x + s_l u) * product over j < l of (1 - coverage_j(x + s_j u))
// A layer is one slab of constant signed blur radius s, or several: the parts of it whose radius lies in one range. A slab is read
// bilinearly at the middle of its range, less the samples whose radius lies outside. Ranges shift from point to point (phase, 0 to
// 1), which averages out the steps between slabs. MAPPED 0: no slab of these blocks reads a radius map.
// CORRECTION 1: `light` already holds each layer's exact mean over the aperture, composited (defocus.cl). The mean of a product
// differs from the product of means by the covariance of the layers over the aperture; only that is added here.
//
// planes: (LAYERS, CHANNELS + COVERAGE, COLUMN_SETS, sample_rows, set_columns) float32, colours [e- s^-1 um^-2 sr^-1] times
//         coverage, then coverage (0 to 1); interleaved columns, a band with its margins (row_band.h).
// radius: (maps, COLUMN_SETS, sample_rows, set_columns) float32, signed blur radius [photosites], > 0 behind the plane in focus.
// light:  (height, width) float32, the mosaic [e- s^-1 um^-2 sr^-1].
// blocks: (blocks, 5) uint32: column within its set and row of the first photosite in the band, first slab, slabs, first point.
// slabs:  (slabs, 5) float32, layer by layer, nearest first: layer, map (-1: constant radius), and three radii [photosites]: at
//         phase 0 the slab's range goes from the first to the second, at phase 1 from the second to the third.
// points: (points, 5) float32, sets of point_count: u in x and y [pupil radii], x and y in the photosite from its centre, phase.
// normalise: 1: light is divided by the share of rays that meet a surface, so that rays that meet none do not darken it.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "plain_math.h"
#include "row_band.h"
#define SIZE (ROWS * SPAN) // photosites of a work-item: rows and columns of one colour

// Weight of a sample in a slab: 0 outside its range of radii.
INLINE float inside(const float radius, const float low, const float high, const float weight) {
    return radius < low || radius >= high ? 0.0f : weight;
}

// Dimension 0: spans of a block; 1: ROWS of its rows, of one colour and so two apart, each as even and odd columns; 2: blocks.
kernel void occlusion(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                      global const uint *restrict blocks, global const float *restrict slabs, global const float *restrict points,
                      const uint point_count, const uint normalise, const struct row_band band) {
    const int parity = (int)(get_global_id(1) & 1);
    global const uint *block = blocks + 5 * get_global_id(2);
    const uint end = block[2] + block[3], group = (uint)(get_global_id(1) >> 1);
    const uint row = block[1] + 2 * ROWS * (group / 2) + group % 2, y = (uint)band.frame_y + row;
    const size_t column = block[0] + get_global_id(0) * SPAN, step = 2 * OVER * band.set_columns; // to the next row of the colour
    const long set_columns = band.set_columns, plane = (long)band.sample_rows * set_columns, colour = cfa_plane((uint)(parity + band.frame_x), y);
    // Sums over points, of each layer and, last, of all. sum: colour less coverage times `sharp`, for smaller rounding errors; seen: coverage.
    float sum[(LAYERS + 1) * SIZE], seen[(LAYERS + 1) * SIZE], before[SIZE], missed[SIZE], covered[SIZE], sharp[SIZE];
    for (uint i = 0; i < (LAYERS + 1) * SIZE; i++) sum[i] = seen[i] = 0.0f;
    global const float *own = planes + (OVER * parity + COLUMN_SETS * colour) * plane + OVER * (long)row * set_columns + column;
    for (uint i = 0; i < SIZE; i++) sharp[i] = own[i / SPAN * step + i % SPAN];
    float *all = sum + LAYERS * SIZE, *all_seen = seen + LAYERS * SIZE;
    for (uint n = 0; n < point_count; n++) {
        global const float *point = points + 5 * (size_t)(block[4] + n);
        int current = -1;
        for (uint i = 0; i < SIZE; i++) before[i] = 1.0f - (covered[i] = 0.0f);
        for (uint k = block[2]; k < end; k++) {
            global const float *slab = slabs + 5 * k;
            if ((int)slab[0] != current) // transmittance of the layers in front
                for (uint i = 0; i < SIZE; i++) {
                    before[i] *= 1.0f - covered[i];
                    missed[i] = 1.0f;
                    covered[i] = 0.0f;
                }
            current = (int)slab[0];
            const float low = slab[2] + (slab[3] - slab[2]) * point[4], high = slab[3] + (slab[4] - slab[3]) * point[4];
            const float middle = 0.5f * (low + high), s = middle > -0.5f && middle < 0.5f ? 0.0f : middle; // the blur circle lies inside the photosite
            const float u = OVER * (s * point[0] + point[2] + 0.5f) - 0.5f, v = OVER * (s * point[1] + point[3] + 0.5f) - 0.5f;
            const int dx = whole(u), dy = whole(v), left = OVER * parity + dx, right = left + 1;
            const float f = u - (float)dx, g = v - (float)dy;
            const float wa = (1.0f - f) * (1.0f - g), wb = f * (1.0f - g), wc = (1.0f - f) * g, wd = f * g;
            const long line = (OVER * (long)row + dy) * set_columns + (long)column;
            const long first = column_set(left) * plane + line + column_in_set(left);
            const long second = column_set(right) * plane + line + column_in_set(right);
            global const float *layer = planes + current * COLUMN_SETS * (CHANNELS + COVERAGE) * plane;
            global const float *map = radius + (slab[1] < 0.0f ? 0 : COLUMN_SETS * (long)slab[1] * plane);
            const float least = slab[1] < 0.0f ? -1e30f : low - 0.25f * (high - low); // overlaps the slab in front, so that slopes show no gaps
            const float most = slab[1] < 0.0f ? 1e30f : high;
            uint left_over = 0;
            for (uint j = 0; j < ROWS; j++) {
                global const float *a = layer + COLUMN_SETS * colour * plane + first + j * step, *b = a + (second - first);
                global const float *c = layer + COLUMN_SETS * CHANNELS * plane + first + j * step, *d = c + (second - first);
                global const float *r = map + first + j * step, *q = r + (second - first);
                for (uint i = 0; i < SPAN; i++) {
                    const size_t m = j * SPAN + i, under = i + set_columns;
                    const float ma = MAPPED ? inside(r[i], least, most, wa) : wa, mb = MAPPED ? inside(q[i], least, most, wb) : wb;
                    const float mc = MAPPED ? inside(r[under], least, most, wc) : wc;
                    const float md = MAPPED ? inside(q[under], least, most, wd) : wd, met = MAPPED ? ma + mb + mc + md : 1.0f;
                    const float cover = COVERAGE ? ma * c[i] + mb * d[i] + mc * c[under] + md * d[under] : met;
                    const float open = (LAYERS > 1 ? before[m] : 1.0f) * missed[m];
                    const float more = ma * a[i] + mb * b[i] + mc * a[under] + md * b[under] - sharp[m] * cover;
                    all[m] += open * more;
                    all_seen[m] += open * cover;
                    if (LAYERS > 1) covered[m] += missed[m] * cover;
                    if (CORRECTION) sum[current * SIZE + m] += missed[m] * more, seen[current * SIZE + m] += missed[m] * cover;
                    missed[m] -= missed[m] * met;
                    left_over |= missed[m] > 1e-3f ? 1u : 0u;
                }
            }
            while (!left_over && k + 1 < end && (int)slabs[5 * k + 5] == current) k++; // the ray is fully covered by this layer: skip its other slabs
        }
    }
    for (uint m = 0; m < SIZE; m++) {
        const uint x = (uint)(2 * (column + m % SPAN) + parity) + (uint)band.frame_x, down = y + 2 * (m / SPAN); // x wraps
        if (x >= band.width || down >= band.height) continue;
        global float *result = light + (size_t)down * band.width + x;
        const float count = point_count, found = normalise ? (all_seen[m] > 1e-6f ? all_seen[m] : 1e-6f) : count;
        float apart_sum = 0.0f, open = 1.0f; // of the layers' means, composited
        for (uint l = 0; l < LAYERS; l++) {
            apart_sum += open * sum[l * SIZE + m];
            open *= 1.0f - seen[l * SIZE + m] / count;
        }
        if (CORRECTION) *result += (all[m] - apart_sum) / count + sharp[m] * (all_seen[m] / count - (1.0f - open));
        else *result = (all[m] + sharp[m] * all_seen[m]) / found;
    }
}
