// Lens blur where surfaces hide each other: points of the aperture, shared by all photosites of a tile. Through each point a
// photosite sees straight lines; along them the surfaces lie over one another, front to back:
//   light(x) = mean over points u of sum over layers l of colour_l (x + s_l u) * product over j < l of (1 - coverage_j (x + s_j u))
// A layer is one slab of constant signed radius s, or several: the parts of it whose radius lies in a range. A slab's s is that of
// its range's middle, and the ranges are shifted from point to point (phase), so that their steps average out.
// A surface is read between its points (bilinear). ways.h has the order of the planes and SPAN.
// CORRECTION 1: `light` already has each layer's exact mean, laid over one another (defocus.cl). That is right but for what
// layers have to do with each other over the aperture, their covariance, which is added here.
//
// planes: (LAYERS, CHANNELS + COVERAGE, WAYS, rows, half_columns) float32: light times coverage of each colour
//         [e- s^-1 um^-2 sr^-1], then coverage, 0 to 1; a strip with its margin.
// radius: (maps, WAYS, rows, half_columns) float32, signed radius [photosites], > 0 behind the plane in focus.
// light:  (height, width) float32, the mosaic.
// tiles:  (tiles, 4) uint32: first half column and row in the strip, first slab, slabs.
// slabs:  (slabs, 4) float32, layer by layer, nearest first: layer, map (-1: constant radius), radius at phase 0, width of the range.
// points: (points, 5) float32: u in x and y (1: edge of the aperture), place in the photosite in x and y, phase (0 to 1).
// margin_x, margin_y, strip_y: as in defocus.cl. normalise: light that meets no surface is replaced by the mean of what does.
#include "conventions.h"
#include "cfa.h"
#include "ways.h"

INLINE int whole(const float v) { return (int)v - (v < (float)(int)v ? 1 : 0); }

// Share of a point that a slab holds; a slab of constant radius has no map and takes whatever it reads.
INLINE float inside(const float radius, const float low, const float high, const float share) {
    return radius < low || radius >= high ? 0.0f : share;
}

// Dimension 0: spans of a tile; 1: its rows, each as even and odd columns; 2: tiles.
kernel void occlusion(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                      global const uint *restrict tiles, global const float *restrict slabs, global const float *restrict points,
                      const uint point_count, const uint normalise, const uint rows, const uint half_columns, const uint margin_x,
                      const uint strip_y, const uint margin_y, const uint width, const uint height) {
    const int parity = (int)(get_global_id(1) & 1);
    global const uint *tile = tiles + 4 * get_global_id(2);
    const uint row = tile[1] + (uint)(get_global_id(1) >> 1), y = strip_y + row - margin_y;
    const size_t column = tile[0] + get_global_id(0) * SPAN;
    const long plane = (long)rows * half_columns;
    if (y >= height) return;
    const long colour = cfa_plane(parity + margin_x, y);
    // of each layer, and of all of them in the last row: colour and coverage, summed over the points
    float sum[(LAYERS + 1) * SPAN], seen[(LAYERS + 1) * SPAN], before[SPAN], missed[SPAN], covered[SPAN];
    for (uint i = 0; i < (LAYERS + 1) * SPAN; i++) sum[i] = seen[i] = 0.0f;
    float *all = sum + LAYERS * SPAN, *all_seen = seen + LAYERS * SPAN;
    for (uint n = 0; n < point_count; n++) {
        global const float *point = points + 5 * n;
        int current = -1;
        for (uint i = 0; i < SPAN; i++) {
            before[i] = 1.0f;
            covered[i] = 0.0f;
        }
        for (uint k = tile[2]; k < tile[2] + tile[3]; k++) {
            global const float *slab = slabs + 4 * k;
            if ((int)slab[0] != current) { // what the layers before leave open
                for (uint i = 0; i < SPAN; i++) {
                    before[i] *= 1.0f - covered[i];
                    missed[i] = 1.0f;
                    covered[i] = 0.0f;
                }
                current = (int)slab[0];
            }
            const float s = slab[2] + slab[3] * point[4];
            const float u = OVER * (s * point[0] + point[2] + 0.5f) - 0.5f, v = OVER * (s * point[1] + point[3] + 0.5f) - 0.5f;
            const int dx = whole(u), dy = whole(v), left = OVER * parity + dx, right = left + 1;
            const float f = u - (float)dx, g = v - (float)dy;
            const float wa = (1.0f - f) * (1.0f - g), wb = f * (1.0f - g), wc = (1.0f - f) * g, wd = f * g;
            const long line = (OVER * (long)row + dy) * half_columns + (long)column;
            const long first = (left & (WAYS - 1)) * plane + line + floor_ways(left);
            const long second = (right & (WAYS - 1)) * plane + line + floor_ways(right);
            global const float *layer = planes + current * WAYS * (CHANNELS + COVERAGE) * plane;
            global const float *a = layer + WAYS * colour * plane + first, *b = layer + WAYS * colour * plane + second;
            global const float *c = layer + WAYS * CHANNELS * plane + first, *d = layer + WAYS * CHANNELS * plane + second;
            const long map = slab[1] < 0.0f ? 0 : WAYS * (long)slab[1] * plane;
            global const float *r = radius + map + first, *q = radius + map + second;
            const float low = slab[1] < 0.0f ? -1e30f : s - 1.5f * slab[3]; // a range more in front: no cracks on slopes
            const float high = slab[1] < 0.0f ? 1e30f : s + 0.5f * slab[3];
            float *own = sum + current * SPAN, *own_seen = seen + current * SPAN;
            uint left_over = 0;
            for (uint i = 0; i < SPAN; i++) {
                const size_t j = i + half_columns;
                const float ma = inside(r[i], low, high, wa), mb = inside(q[i], low, high, wb);
                const float mc = inside(r[j], low, high, wc), md = inside(q[j], low, high, wd);
                const float met = ma + mb + mc + md, light_met = missed[i] * (ma * a[i] + mb * b[i] + mc * a[j] + md * b[j]);
#if COVERAGE
                const float cover = missed[i] * (ma * c[i] + mb * d[i] + mc * c[j] + md * d[j]);
#else
                const float cover = missed[i] * met;
#endif
                missed[i] -= missed[i] * met;
                left_over |= missed[i] > 1e-3f ? 1u : 0u;
                covered[i] += cover;
                all[i] += before[i] * light_met;
                all_seen[i] += before[i] * cover;
#if CORRECTION
                own[i] += light_met;
                own_seen[i] += cover;
#endif
            }
            while (!left_over && k + 1 < tile[2] + tile[3] && (int)slabs[4 * k + 4] == current) k++; // nothing is left of this layer's
        }
    }
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) - margin_x; // wraps to a large number in the margin
        const float whole_share = normalise ? (all_seen[i] > 1e-6f ? all_seen[i] : 1e-6f) : (float)point_count;
#if CORRECTION
        float apart_light = 0.0f, open = 1.0f;
        for (uint l = 0; l < LAYERS; l++) {
            apart_light += open * sum[l * SPAN + i] / point_count;
            open *= 1.0f - seen[l * SPAN + i] / point_count;
        }
        if (x < width) light[(size_t)y * width + x] += all[i] / point_count - apart_light;
#else
        if (x < width) light[(size_t)y * width + x] = all[i] / whole_share;
#endif
    }
}
