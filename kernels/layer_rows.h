// Cells of even light into which borders of pixels of all layers cut the pixels of the last one (layer_cells.cl). The host defines LAYERS, SPAN,
// STEP, and WHOLE, WIDTH and LINE as there.
#ifndef LAYER_ROWS_H
#define LAYER_ROWS_H
#include "bilinear_area.h"
#include "lanes.h"

// The last layer's place at an instant, and cells within its pixels.
struct cells {
    int column, row;                // of its pixel, from the one at rest
    float right, down;              // past that pixel's borders [px]
    float across[5], below[5];      // where columns and rows of cells begin, from 0 to 1 [px]
    int left[16], above[16];        // pixel of layer n in column or row m of cells, at [4 m + n], from the last layer's
    float weight;                   // share of the instant in the line's light, per area of a photosite [px^-2]
};

// Rows of the layers' planes, from the first pixel of a span on.
struct rows {
    global const float *light[LAYERS], *cover[LAYERS];
    int first[LAYERS];              // column of that pixel
};

// How far the parts [begin, end) and [low, high) of a line overlap.
INLINE float shared(const float begin, const float end, const float low, const float high) {
    const float part = smaller(end, high) - larger(begin, low);
    return part > 0.0f ? part : 0.0f;
}

// Composite a row of cells, `tall` high, and add it to `line` (LINE). inside: whether no pixel lies beyond the scene.
INLINE void add_cells(const struct rows rows, const float tall, const int inside, const uint width, float *line) {
    LANES
    for (int i = 0; i < LINE; i++) {
        float through = tall, seen = 0.0f;
        __attribute__((opencl_unroll_hint(LAYERS)))
        for (uint n = 0; n < LAYERS; n++) {
            const int column = inside ? i : clamped(rows.first[n] + i, width) - rows.first[n];
            seen += through * rows.light[n][column];
            if (n + 1 < LAYERS) through *= 1.0f - rows.cover[n][column];
        }
        line[i] += seen;
    }
}

// Add what the photosites of a span see of its cells to `sum` (SPAN). pixel, past: places of the photosites, from the first one's pixel on
// [px]. shift: of the last layer. begins: pixel at which `lines` do.
INLINE void add_photosites(const float lines[LAYERS][LINE], const float *across, const int *pixel, const float *past, const float shift,
                           const int begins, const float side, const float weight, float *sum) {
    LANES
    for (int i = 0; i < SPAN; i++) {
        const float low = past[WHOLE ? 0 : i] + shift;
        const int first = WHOLE ? WHOLE * i : pixel[i] + whole(low) - begins;
        const float begin = low - (float)whole(low), end = begin + side;
        float seen = 0.0f;
        __attribute__((opencl_unroll_hint(WIDTH)))
        for (int j = 0; j < WIDTH; j++)
            __attribute__((opencl_unroll_hint(LAYERS)))
            for (uint m = 0; m < LAYERS; m++)
                seen += shared((float)j + across[m], (float)j + across[m + 1], begin, end) * lines[m][first + j];
        sum[i] += weight * seen;
    }
}

#endif
