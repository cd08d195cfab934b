// Light of a span of photosites of one row and colour, STEP photosites apart, through layers that lie at places of their own, read bilinearly
// (swept_layers.cl). The host defines LAYERS, and CHANNELS, after which the planes of a layer hold its coverage.
#ifndef LAYER_SPANS_H
#define LAYER_SPANS_H
#include "bilinear_area.h"
#include "lanes.h"
#define PIXELS (STEP * (SPAN - 1) + 2) // of a line that a span reads

// Place of a layer at an instant.
struct spot {
    int column, row;    // of the left upper one of four pixels that are read, from the pixel of the photosite's own column and row
    float right, below; // between the four pixels, 0 to 1
};

struct layers {
    int origin_x, origin_y;         // photosite of the sensor at [0, 0] of the frame
    uint width;                     // of the frame [photosites]
    int first_column;               // of the first span in the frame; spans begin at multiples of STEP SPAN photosites of the sensor
    uint first_row;                 // of the launch in the frame
    uint mosaic_row, colour;        // of the plane in `mosaic`; of the layers' planes (STEP 2: not read)
    uint instants, lines;           // of each line; of the table
    uint rows, above;               // of each line where there are several; those of the first above the launch
    uint scene_width, scene_height; // of the scene's grid [px]
};

// Two lines of a plane's pixels, from the first that a span reads on; where some of those lie beyond the scene, from the scene's first on.
struct lines {
    global const float *upper, *lower;
};

INLINE float between(const float from, const float to, const float share) { return from + share * (to - from); }

INLINE struct lines lines_of(global const float *plane, const int row, const int first, const struct layers layers) {
    const struct lines found = {plane + (size_t)clamped(row, layers.scene_height) * layers.scene_width + first,
                                plane + (size_t)clamped(row + 1, layers.scene_height) * layers.scene_width + first};
    return found;
}

// Blend two lines of the scene into PIXELS pixels from column `first` on.
INLINE void blend(const struct lines at, const int first, const float below, const uint width, float *blended) {
    const int begin = clamped(-first, PIXELS + 1), end = clamped((int)width - first, PIXELS + 1);
    const float left = between(at.upper[0], at.lower[0], below), right = between(at.upper[width - 1], at.lower[width - 1], below);
    for (int j = 0; j < PIXELS; j++) blended[j] = j < begin ? left : right;
    for (int j = begin; j < end; j++) blended[j] = between(at.upper[first + j], at.lower[first + j], below);
}

// Reading of photosite i of a span; edge: of lines that are `blended`.
INLINE float read(const struct lines at, const float *blended, const int edge, const uint i, const struct spot spot) {
    const uint left = STEP * i, next = STEP * i + 1;
    const float near = edge ? blended[left] : between(at.upper[left], at.lower[left], spot.below);
    return between(near, edge ? blended[next] : between(at.upper[next], at.lower[next], spot.below), spot.right);
}

// Add layers from `begin` to `end` to `sum`, by the light `open` that reaches them or, where that is null, by `weight`; what they let
// through is added to `passed` if it is not null. edge: whether pixels lie beyond the scene. x, y: of the span's first photosite.
INLINE void add_layers(global const float *const *planes, global const struct spot *spots, const uint begin, const uint end, const uint colour,
                       const int x, const int y, const int edge, const float weight, const float *open, float *sum, float *passed,
                       const struct layers layers) {
    const size_t pixels = (size_t)layers.scene_width * layers.scene_height;
    struct lines light[LAYERS], cover[LAYERS];
    struct spot spot[LAYERS];
    float blended_light[LAYERS * PIXELS], blended_cover[LAYERS * PIXELS];
    __attribute__((opencl_unroll_hint(LAYERS)))
    for (uint n = begin; n < end; n++) {
        spot[n] = spots[n];
        const int row = y + spot[n].row, first = x + spot[n].column;
        light[n] = lines_of(planes[n] + colour * pixels, row, edge ? 0 : first, layers);
        cover[n] = lines_of(planes[n] + (n + 1 < LAYERS ? CHANNELS : colour) * pixels, row, edge ? 0 : first, layers);
        if (edge) {
            blend(light[n], first, spot[n].below, layers.scene_width, blended_light + n * PIXELS);
            if (n + 1 < LAYERS) blend(cover[n], first, spot[n].below, layers.scene_width, blended_cover + n * PIXELS);
        }
    }
    LANES
    for (uint i = 0; i < SPAN; i++) {
        float through = open ? open[i] : weight, seen = 0.0f;
        __attribute__((opencl_unroll_hint(LAYERS)))
        for (uint n = begin; n < end; n++) {
            seen += through * read(light[n], blended_light + n * PIXELS, edge, i, spot[n]);
            if (n + 1 < LAYERS) through *= 1.0f - read(cover[n], blended_cover + n * PIXELS, edge, i, spot[n]);
        }
        sum[i] += seen;
        if (passed) passed[i] += through;
    }
}

// Whether all pixels that a span reads in layers from `begin` to `end` lie in the scene.
INLINE int is_inside(global const struct spot *spots, const uint begin, const uint end, const int x, const struct layers layers) {
    int inside = 1;
    for (uint n = begin; n < end; n++) {
        const int first = x + spots[n].column;
        inside &= first >= 0 && first + PIXELS <= (int)layers.scene_width;
    }
    return inside;
}

#endif
