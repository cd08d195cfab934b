// Lens blur where surfaces hide each other: points of the aperture, shared by all photosites of a tile. Through each point a
// photosite sees straight lines; along them the surfaces lie over one another, front to back:
//   light(x) = mean over points u of sum over layers l of colour_l(x + s_l u) * product over j < l of (1 - coverage_j(x + s_j u))
// A layer is one slab of constant signed radius s, or several: its parts whose radius lies in a range. A slab's s is its range's
// middle, and the ranges are shifted from point to point (phase), so that their steps average out. Surfaces are read bilinearly.
// CORRECTION 1: `light` already has each layer's exact mean, laid over one another (defocus.cl). That is right but for what
// layers have to do with each other over the aperture, their covariance, which is added here.
//
// planes: (LAYERS, CHANNELS + COVERAGE, WAYS, rows, way_columns) float32: light times coverage of each colour
//         [e- s^-1 um^-2 sr^-1], then coverage, 0 to 1; a strip with its margin, in the order of ways.h.
// radius: (maps, WAYS, rows, way_columns) float32, signed radius [photosites], > 0 behind the plane in focus.
// light:  (height, width) float32, the mosaic.
// tiles:  (tiles, 4) uint32: first way column and row in the strip, first slab, slabs.
// slabs:  (slabs, 5) float32, layer by layer, nearest first: layer, map (-1: constant radius), and three radii: at phase 0 the
//         range goes from the first to the second, at phase 1 from the second to the third.
// points: (points, 5) float32: u in x and y (1: edge of the aperture), place in the photosite in x and y, phase (0 to 1).
// margin_x, margin_y, strip_y: as in defocus.cl. normalise: light that meets no surface is replaced by the mean of what does.
#include "conventions.h"
#include "cfa.h"
#include "plain_math.h"
#include "ways.h"

// Share of a point that a slab holds; without a map it takes whatever it reads.
INLINE float inside(const float radius, const float low, const float high, const float share) {
    return radius < low || radius >= high ? 0.0f : share;
}

// Dimension 0: spans of a tile; 1: its rows, each as even and odd columns; 2: tiles.
kernel void occlusion(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                      global const uint *restrict tiles, global const float *restrict slabs, global const float *restrict points,
                      const uint point_count, const uint normalise, const uint rows, const uint way_columns, const uint margin_x,
                      const uint strip_y, const uint margin_y, const uint width, const uint height) {
    const int parity = (int)(get_global_id(1) & 1);
    global const uint *tile = tiles + 4 * get_global_id(2);
    const uint end = tile[2] + tile[3], row = tile[1] + (uint)(get_global_id(1) >> 1), y = strip_y + row - margin_y;
    const size_t column = tile[0] + get_global_id(0) * SPAN;
    const long plane = (long)rows * way_columns, colour = cfa_plane(parity + margin_x, y);
    if (y >= height) return;
    // Over all points, of each layer and, last, of all: what the colour exceeds `sharp` where something covers, and coverage.
    float sum[(LAYERS + 1) * SPAN], seen[(LAYERS + 1) * SPAN], before[SPAN], missed[SPAN], covered[SPAN], sharp[SPAN];
    for (uint i = 0; i < (LAYERS + 1) * SPAN; i++) sum[i] = seen[i] = 0.0f;
    global const float *own = planes + (OVER * parity + WAYS * colour) * plane + OVER * (long)row * way_columns + column;
    for (uint i = 0; i < SPAN; i++) sharp[i] = own[i];
    float *all = sum + LAYERS * SPAN, *all_seen = seen + LAYERS * SPAN;
    for (uint n = 0; n < point_count; n++) {
        global const float *point = points + 5 * n;
        int current = -1;
        for (uint i = 0; i < SPAN; i++) before[i] = 1.0f - (covered[i] = 0.0f);
        for (uint k = tile[2]; k < end; k++) {
            global const float *slab = slabs + 5 * k;
            if ((int)slab[0] != current) // what the layers before leave open
                for (uint i = 0; i < SPAN; i++) {
                    before[i] *= 1.0f - covered[i];
                    missed[i] = 1.0f;
                    covered[i] = 0.0f;
                }
            current = (int)slab[0];
            const float low = slab[2] + (slab[3] - slab[2]) * point[4], high = slab[3] + (slab[4] - slab[3]) * point[4];
            const float middle = 0.5f * (low + high), s = middle > -0.5f && middle < 0.5f ? 0.0f : middle; // in its photosite
            const float u = OVER * (s * point[0] + point[2] + 0.5f) - 0.5f, v = OVER * (s * point[1] + point[3] + 0.5f) - 0.5f;
            const int dx = whole(u), dy = whole(v), left = OVER * parity + dx, right = left + 1;
            const float f = u - (float)dx, g = v - (float)dy;
            const float wa = (1.0f - f) * (1.0f - g), wb = f * (1.0f - g), wc = (1.0f - f) * g, wd = f * g;
            const long line = (OVER * (long)row + dy) * way_columns + (long)column;
            const long first = (left & (WAYS - 1)) * plane + line + floor_ways(left);
            const long second = (right & (WAYS - 1)) * plane + line + floor_ways(right);
            global const float *layer = planes + current * WAYS * (CHANNELS + COVERAGE) * plane;
            global const float *a = layer + WAYS * colour * plane + first, *b = layer + WAYS * colour * plane + second;
            global const float *c = layer + WAYS * CHANNELS * plane + first, *d = layer + WAYS * CHANNELS * plane + second;
            const long map = slab[1] < 0.0f ? 0 : WAYS * (long)slab[1] * plane;
            global const float *r = radius + map + first, *q = radius + map + second;
            const float least = slab[1] < 0.0f ? -1e30f : low - 0.25f * (high - low); // a little in front: no cracks on slopes
            const float most = slab[1] < 0.0f ? 1e30f : high;
            uint left_over = 0;
            for (uint i = 0; i < SPAN; i++) {
                const size_t j = i + way_columns;
                const float ma = inside(r[i], least, most, wa), mb = inside(q[i], least, most, wb), e = sharp[i];
                const float mc = inside(r[j], least, most, wc), md = inside(q[j], least, most, wd), met = ma + mb + mc + md;
                const float ca = COVERAGE ? c[i] : 1.0f, cb = COVERAGE ? d[i] : 1.0f;
                const float cc = COVERAGE ? c[j] : 1.0f, cd = COVERAGE ? d[j] : 1.0f;
                const float cover = missed[i] * (ma * ca + mb * cb + mc * cc + md * cd);
                const float upper = ma * (a[i] - e * ca) + mb * (b[i] - e * cb), lower = mc * (a[j] - e * cc) + md * (b[j] - e * cd);
                const float more = missed[i] * (upper + lower);
                missed[i] -= missed[i] * met;
                left_over |= missed[i] > 1e-3f ? 1u : 0u;
                all[i] += (LAYERS > 1 ? before[i] : 1.0f) * more;
                all_seen[i] += (LAYERS > 1 ? before[i] : 1.0f) * cover;
                if (LAYERS > 1) covered[i] += cover;
                if (CORRECTION) sum[current * SPAN + i] += more;
                if (CORRECTION) seen[current * SPAN + i] += cover;
            }
            while (!left_over && k + 1 < end && (int)slabs[5 * k + 5] == current) k++; // nothing is left of this layer's
        }
    }
    for (uint i = 0; i < SPAN; i++) {
        const uint x = (uint)(2 * (column + i) + parity) - margin_x; // wraps to a large number in the margin
        if (x >= width) continue;
        global float *result = light + (size_t)y * width + x;
        const float count = point_count, found = normalise ? (all_seen[i] > 1e-6f ? all_seen[i] : 1e-6f) : count;
        float apart_sum = 0.0f, open = 1.0f; // of the layers' means laid over one another
        for (uint l = 0; l < LAYERS; l++) {
            apart_sum += open * sum[l * SPAN + i];
            open *= 1.0f - seen[l * SPAN + i] / count;
        }
        if (CORRECTION) *result += (all[i] - apart_sum) / count + sharp[i] * (all_seen[i] / count - (1.0f - open));
        else *result = (all[i] + sharp[i] * all_seen[i]) / found;
    }
}
