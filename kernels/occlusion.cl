// Lens blur where surfaces hide each other: points of the aperture, shared by all photosites of a tile. Through each point a
// photosite sees straight lines; along them the surfaces lie over one another, front to back:
//   light(x) = mean over points u of sum over slabs k of coverage_k colour_k (x + s_k u) * product over j < k of (1 - coverage_j)
// A slab is a surface of constant signed radius s, or the part of a surface whose radius lies in a range: its s is that of the
// range's middle, and the ranges are shifted from point to point (phase), so that their steps average out.
// A surface is read at x + s u between its photosites (bilinear). All that a line needs is the same for all photosites of a
// tile but its start, so that they are read side by side; see ways.h for the order of the planes and SPAN.
//
// planes: (LAYERS, CHANNELS + COVERAGE, WAYS, rows, half_columns) float32: light times coverage of each colour
//         [e- s^-1 um^-2 sr^-1], then coverage, 0 to 1; a strip with its margin.
// radius: (MAPS, WAYS, rows, half_columns) float32, signed radius [photosites], > 0 behind the plane in focus.
// light:  (height, width) float32, the mosaic.
// tiles:  (tiles, 4) uint32: first half column and row in the strip, first slab, slabs.
// slabs:  (slabs, 4) float32: layer, map (-1: constant radius), radius at phase 0, step: width of the range.
// points: (points, 5) float32: u in x and y (1: edge of the aperture), place in the photosite in x and y, phase (0 to 1).
// margin_x, margin_y, strip_y: as in defocus.cl. normalise: light that meets no surface is replaced by the mean of what does.
#include "conventions.h"
#include "cfa.h"
#include "ways.h"

INLINE int whole(const float v) { return (int)v - (v < (float)(int)v ? 1 : 0); }

INLINE float inside(const float radius, const float low, const float high, const float share) {
    return radius >= low && radius < high ? share : 0.0f;
}

// Dimension 0: spans of a tile; 1: its rows, each as even and odd columns; 2: tiles.
kernel void occlusion(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                      global const uint *restrict tiles, global const float *restrict slabs, global const float *restrict points,
                      const uint point_count, const uint normalise, const uint rows, const uint half_columns,
                      const uint margin_x, const uint strip_y, const uint margin_y,
                      const uint width, const uint height) {
    const int parity = (int)(get_global_id(1) & 1);
    global const uint *tile = tiles + 4 * get_global_id(2);
    const uint row = tile[1] + (uint)(get_global_id(1) >> 1), y = strip_y + row - margin_y;
    const size_t column = tile[0] + get_global_id(0) * SPAN;
    const long plane = (long)rows * half_columns;
    if (y >= height) return;
    const long colour = cfa_plane(parity + margin_x, y);
    float sum[SPAN], seen[SPAN], through[SPAN];
    for (uint i = 0; i < SPAN; i++) sum[i] = seen[i] = 0.0f;
    for (uint n = 0; n < point_count; n++) {
        global const float *point = points + 5 * n;
        for (uint i = 0; i < SPAN; i++) through[i] = 1.0f;
        for (uint k = tile[2]; k < tile[2] + tile[3]; k++) {
            global const float *slab = slabs + 4 * k;
            const float s = slab[2] + slab[3] * point[4];
            const float u = OVER * (s * point[0] + point[2] + 0.5f) - 0.5f, v = OVER * (s * point[1] + point[3] + 0.5f) - 0.5f;
            const int dx = whole(u), dy = whole(v), left = OVER * parity + dx, right = left + 1;
            const float f = u - (float)dx, g = v - (float)dy;
            const float wa = (1.0f - f) * (1.0f - g), wb = f * (1.0f - g), wc = (1.0f - f) * g, wd = f * g;
            const long line = (OVER * (long)row + dy) * half_columns + (long)column;
            const long first = (left & (WAYS - 1)) * plane + line + floor_ways(left);
            const long second = (right & (WAYS - 1)) * plane + line + floor_ways(right);
            global const float *layer = planes + (long)slab[0] * WAYS * (CHANNELS + COVERAGE) * plane;
            global const float *a = layer + WAYS * colour * plane + first, *b = layer + WAYS * colour * plane + second;
            global const float *c = layer + WAYS * CHANNELS * plane + first, *d = layer + WAYS * CHANNELS * plane + second;
            if (slab[1] >= 0.0f) {
                global const float *map = radius + WAYS * (long)slab[1] * plane, *r = map + first, *q = map + second;
                const float low = s - 1.5f * slab[3], high = s + 0.5f * slab[3]; // a range more in front: no cracks on slopes
                for (uint i = 0; i < SPAN; i++) {
                    const float ma = inside(r[i], low, high, wa), mb = inside(q[i], low, high, wb);
                    const float mc = inside(r[i + half_columns], low, high, wc), md = inside(q[i + half_columns], low, high, wd);
#if COVERAGE
                    const float covered = ma * c[i] + mb * d[i] + mc * c[i + half_columns] + md * d[i + half_columns];
#else
                    const float covered = ma + mb + mc + md;
#endif
                    sum[i] += through[i] * (ma * a[i] + mb * b[i] + mc * a[i + half_columns] + md * b[i + half_columns]);
                    seen[i] += through[i] * covered;
                    through[i] -= through[i] * covered;
                }
            } else {
                for (uint i = 0; i < SPAN; i++) {
#if COVERAGE
                    const float covered = wa * c[i] + wb * d[i] + wc * c[i + half_columns] + wd * d[i + half_columns];
#else
                    const float covered = 1.0f;
#endif
                    sum[i] += through[i] * (wa * a[i] + wb * b[i] + wc * a[i + half_columns] + wd * b[i + half_columns]);
                    seen[i] += through[i] * covered;
                    through[i] -= through[i] * covered;
                }
            }
        }
    }
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) - margin_x; // wraps to a large number in the margin
        if (x < width) light[(size_t)y * width + x] = sum[i] / (normalise ? (seen[i] > 1e-6f ? seen[i] : 1e-6f) : (float)point_count);
    }
}
