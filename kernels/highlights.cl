// Highlights where surfaces occlude each other. A highlight is a sample so bright that through a few points of the aperture it would
// show as separate dots. highlights_mark tells where any is. highlights_take takes them out of the planes that occlusion.cl samples.
// highlights_spread then adds to each photosite its share of the highlight's blur spot:
//   light(x) += sum over highlights p of excess_p * weight(p - x) * (1 - g_p u) * product over nearer j of (1 - coverage_j(x + s_j u))
// A photosite sees the highlight through the one point u = (p - x) / s_p of the aperture. With the slope g of its surface's radius an
// area dp of the surface fills du = (1 - g u) dp / s^2 of the aperture.
//
// sampled: (LAYERS, channels + COVERAGE, COLUMN_SETS, sample_rows, set_columns) float32, as `planes` of occlusion.cl.
// marks:   (LAYERS, COLUMN_SETS, sample_rows, set_columns / CHUNK) uchar, whether any of so many samples side by side is above `limits`,
//          (channels) float32 [e- s^-1 um^-2 sr^-1], in any colour.
// places:  (samples) uint32, elements of `sampled` that are changed. most: (samples) float32, what they keep at most.
// radius, light, slabs: as in occlusion.cl. blocks: (blocks, 4) uint32, as the first four numbers there.
// ranges:  (blocks, 2) uint32: first entry of a block in `reaching`, and number of entries.
// reaching: (entries) uint32: which of `highlights` reach the block.
// highlights: (highlights, 5) int32: column and row of the highlight's sample in the band, layer, first element and side of its weights.
// excess:  (highlights, 3 + channels) float32: signed blur radius [photosites], its slopes g in x and y [photosites per photosite], and
//          the radiance taken out of each colour [e- s^-1 um^-2 sr^-1].
// weights: (elements) float32, squares of `side`: share of a highlight that a photosite gets, by the offset in samples from the
//          photosite's first sample to the highlight's.
#include "conventions.h"
#include "interleaved_columns.h"
#include "plain_math.h"
#include "row_band.h"
#include "slab_list.h"

#define LEAST 0.5f  // blur radius below which the spot is that of the photosite [photosites]
#define NEARER 1.0f // least difference in blur radius by which a slab of the highlight's own layer lies before it [photosites]

// Dimension 0: parts of CHUNK samples of a row; 1: rows of samples; 2: column sets of all layers.
kernel void highlights_mark(global const float *restrict sampled, global uchar *restrict marks, global const float *restrict limits,
                            const uint channels) {
    const size_t part = get_global_id(0), row = get_global_id(1), set = get_global_id(2) % COLUMN_SETS, layer = get_global_id(2) / COLUMN_SETS;
    uint above = 0;
    for (uint c = 0; c < channels; c++) {
        const size_t plane = COLUMN_SETS * (layer * (channels + COVERAGE) + c) + set;
        global const float *own = sampled + row_start(plane, row, get_global_size(1), CHUNK * get_global_size(0)) + CHUNK * part;
        for (uint i = 0; i < CHUNK; i++) above |= own[i] > limits[c];
    }
    marks[row_start(get_global_id(2), row, get_global_size(1), get_global_size(0)) + part] = (uchar)above;
}

kernel void highlights_take(global float *restrict sampled, global const uint *restrict places, global const float *restrict most) {
    global float *own = sampled + places[get_global_id(0)];
    *own = smaller(*own, most[get_global_id(0)]);
}

// Sample of a plane at [row][column], both of samples.
INLINE float sample_at(global const float *plane, const int column, const int row, const struct row_band band) {
    return plane[row_start(column_set(column), row, band.sample_rows, band.set_columns) + column_in_set(column)];
}

// Dimension 0: photosites of a row and parity in a block; 1: its rows, each as even and odd columns; 2: blocks.
kernel void highlights_spread(global const float *restrict sampled, global const float *restrict radius, global float *restrict light,
                          global const uint *restrict blocks, global const float *restrict slabs,
                          global const uint *restrict ranges, global const uint *restrict reaching,
                          global const int *restrict highlights, global const float *restrict excess,
                          global const float *restrict weights, const struct row_band band) {
    global const uint *block = blocks + 4 * get_global_id(2), *range = ranges + 2 * get_global_id(2);
    const int across = (int)(2 * (block[0] + get_global_id(0)) + (get_global_id(1) & 1)), down = (int)(block[1] + get_global_id(1) / 2);
    const uint x = (uint)(across + band.frame_x), y = (uint)(down + band.frame_y); // wrap to large numbers in the margin
    if (x >= band.width || y >= band.height) return;
    const size_t plane = row_start(COLUMN_SETS, 0, band.sample_rows, band.set_columns); // elements
    const uint colour = band_color((uint)across, (uint)down, band);
    float sum = 0.0f;
    for (uint n = range[0]; n < range[0] + range[1]; n++) {
        global const int *point = highlights + 5 * reaching[n];
        global const float *own = excess + (3 + band.channels) * reaching[n];
        const int middle = (point[4] - OVER) / 2, i = point[0] - OVER * across + middle, j = point[1] - OVER * down + middle;
        if (i < 0 || j < 0 || i >= point[4] || j >= point[4]) continue;
        const float size = own[0] < 0.0f ? smaller(own[0], -LEAST) : larger(own[0], LEAST);
        const float towards_x = (((float)point[0] + 0.5f) * (1.0f / OVER) - ((float)across + 0.5f)) / size;
        const float towards_y = (((float)point[1] + 0.5f) * (1.0f / OVER) - ((float)down + 0.5f)) / size;
        const float tilt = larger(1.0f - own[1] * towards_x - own[2] * towards_y, 0.0f);
        const float share = weights[point[3] + j * point[4] + i] * tilt * own[3 + colour];
        float open = 1.0f, missed = 1.0f, covered = 0.0f;
        int current = -1;
        for (uint k = block[2]; k < block[2] + block[3] && (int)slabs[slab_element(k)] <= point[2]; k++) {
            global const float *slab = slabs + slab_element(k);
            const float map_number = slab[SLAB_GROUP], border = slab[3 * SLAB_GROUP];
            if ((int)slab[0] != current) {
                open *= 1.0f - covered;
                missed = 1.0f;
                covered = 0.0f;
            }
            current = (int)slab[0];
            const float low = 0.5f * (slab[2 * SLAB_GROUP] + border), high = 0.5f * (border + slab[4 * SLAB_GROUP]), s = 0.5f * (low + high);
            if (current == point[2] && high + NEARER > own[0]) continue;
            const float u = OVER * ((float)across + s * towards_x + 0.5f) - 0.5f, v = OVER * ((float)down + s * towards_y + 0.5f) - 0.5f;
            const int left = whole(u), top = whole(v);
            const float f = u - (float)left, g = v - (float)top;
            global const float *coverage = sampled + (current * (band.channels + COVERAGE) + band.channels) * plane;
            global const float *map = radius + (map_number < 0.0f ? 0 : (size_t)map_number * plane);
            float met = 0.0f, cover = 0.0f;
            for (int corner = 0; corner < 4; corner++) {
                const int c = left + corner % 2, r = top + corner / 2;
                const float px = map_number < 0.0f ? low : sample_at(map, c, r, band);
                const float inside = map_number < 0.0f || (px >= low && px < high) ? 1.0f : 0.0f;
                const float weight = inside * (corner % 2 ? f : 1.0f - f) * (corner / 2 ? g : 1.0f - g);
                met += weight;
                cover += weight * (COVERAGE ? sample_at(coverage, c, r, band) : 1.0f);
            }
            covered += missed * cover;
            missed -= missed * met;
        }
        sum += share * open * (1.0f - covered);
    }
    light[((size_t)band.light_row + y) * band.width + x] += sum;
}
