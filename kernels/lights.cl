// Points of light where surfaces hide each other. A few points of the aperture would make dots of a small bright light's spot, so
// lights leave the planes that points sample (lights_take), and each photosite gets its share of their spots (lights_spread):
//   light(x) += sum over lights p of excess_p * weight(p - x) * product over nearer surfaces j of (1 - coverage_j(x + s_j u))
// where u = (p - x) / s_p is the one point of the aperture through which the photosite sees the light.
//
// sampled: (LAYERS, CHANNELS + COVERAGE, WAYS, rows, way_columns) float32, as `planes` of occlusion.cl; there colour
//          [e- s^-1 um^-2 sr^-1] and coverage. places: (count) uint32 of its elements; left: (count) float32, what stays there.
// radius, light, blocks, slabs, margin_x, margin_y, strip_y: as in occlusion.cl.
// ranges:  (blocks, 2) uint32: first entry and entries of a block in `reaching`: (entries) uint32, the lights that reach it.
// lights:  (lights, 5) int32: column and row of its sample in the strip, layer, first element and side of its weights.
// excess:  (lights, 1 + CHANNELS) float32: signed radius [photosites], and what was taken of each colour.
// weights: (elements) float32, share of a light that a photosite gets, by the sample's distance from the photosite's first one.
#include "conventions.h"
#include "cfa.h"
#include "plain_math.h"
#include "ways.h"

#define NEARER 1.0f // photosites of radius by which a surface lies before the light's own

kernel void lights_take(global float *restrict sampled, global const uint *restrict places, global const float *restrict left) {
    sampled[places[get_global_id(0)]] = left[get_global_id(0)];
}

// Value of a plane at a column and a row of samples.
INLINE float sample_at(global const float *plane, const int column, const int row, const uint rows, const uint way_columns) {
    return plane[((size_t)(column & (WAYS - 1)) * rows + row) * way_columns + floor_ways(column)];
}

// Dimension 0: half columns of a block; 1: its rows, each as even and odd columns; 2: blocks.
kernel void lights_spread(global const float *restrict sampled, global const float *restrict radius, global float *restrict light,
                          global const uint *restrict blocks, global const float *restrict slabs,
                          global const uint *restrict ranges, global const uint *restrict reaching,
                          global const int *restrict lights, global const float *restrict excess,
                          global const float *restrict weights, const uint rows, const uint way_columns, const uint margin_x,
                          const uint strip_y, const uint margin_y, const uint width, const uint height) {
    global const uint *block = blocks + 4 * get_global_id(2), *range = ranges + 2 * get_global_id(2);
    const int across = (int)(2 * (block[0] + get_global_id(0)) + (get_global_id(1) & 1)), down = (int)(block[1] + get_global_id(1) / 2);
    const uint x = (uint)across - margin_x, y = strip_y + (uint)down - margin_y; // wrap in the margin
    if (x >= width || y >= height) return;
    const size_t plane = (size_t)WAYS * rows * way_columns;
    float sum = 0.0f;
    for (uint n = range[0]; n < range[0] + range[1]; n++) {
        global const int *point = lights + 5 * reaching[n];
        global const float *own = excess + (1 + CHANNELS) * reaching[n];
        const int middle = (point[4] - OVER) / 2, i = point[0] - OVER * across + middle, j = point[1] - OVER * down + middle;
        if (i < 0 || j < 0 || i >= point[4] || j >= point[4]) continue;
        const float share = weights[point[3] + j * point[4] + i] * own[1 + cfa_plane(x, y)];
        const float towards_x = (((float)point[0] + 0.5f) * (1.0f / OVER) - ((float)across + 0.5f)) / own[0];
        const float towards_y = (((float)point[1] + 0.5f) * (1.0f / OVER) - ((float)down + 0.5f)) / own[0];
        float open = 1.0f, missed = 1.0f, covered = 0.0f;
        int current = -1;
        for (uint k = block[2]; k < block[2] + block[3] && (int)slabs[5 * k] <= point[2]; k++) {
            global const float *slab = slabs + 5 * k;
            if ((int)slab[0] != current) {
                open *= 1.0f - covered;
                missed = 1.0f;
                covered = 0.0f;
            }
            current = (int)slab[0];
            const float low = 0.5f * (slab[2] + slab[3]), high = 0.5f * (slab[3] + slab[4]), s = 0.5f * (low + high);
            if (current == point[2] && high + NEARER > own[0]) continue;
            const float u = OVER * ((float)across + s * towards_x + 0.5f) - 0.5f, v = OVER * ((float)down + s * towards_y + 0.5f) - 0.5f;
            const int left = whole(u), top = whole(v);
            const float f = u - (float)left, g = v - (float)top;
            global const float *coverage = sampled + (current * (CHANNELS + COVERAGE) + CHANNELS) * plane;
            global const float *map = radius + (slab[1] < 0.0f ? 0 : (size_t)slab[1] * plane);
            float met = 0.0f, cover = 0.0f;
            for (int corner = 0; corner < 4; corner++) {
                const int c = left + corner % 2, r = top + corner / 2;
                const float px = slab[1] < 0.0f ? low : sample_at(map, c, r, rows, way_columns);
                const float inside = slab[1] < 0.0f || (px >= low && px < high) ? 1.0f : 0.0f;
                const float weight = inside * (corner % 2 ? f : 1.0f - f) * (corner / 2 ? g : 1.0f - g);
                met += weight;
                cover += weight * (COVERAGE ? sample_at(coverage, c, r, rows, way_columns) : 1.0f);
            }
            covered += missed * cover;
            missed -= missed * met;
        }
        sum += share * open * (1.0f - covered);
    }
    light[(size_t)y * width + x] += sum;
}
