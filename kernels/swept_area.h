// Light of a span of photosites of one row and colour, STEP photosites apart, at one instant of a moving image: displacements that are
// a parabola along the span. A photosite is read as in photosite_area.h: the mean of a fine scene over its open square (TAPS > 0: rows of
// the scene are blended first, then read along the row), of one of fewer pixels (BENDS 1), or a value at its middle.
#ifndef SWEPT_AREA_H
#define SWEPT_AREA_H
#include "lanes.h"
#include "plain_math.h"
#include "photosite_area.h"
#include "swept_path.h"

// Weight of a scene pixel that begins at `low`, counted from it, in a square of this side, or in a bilinear reading at `low`.
INLINE float share_of(const float low, const float side) {
    const float far = low < 0.0f ? -low : low, share = TAPS ? smaller(low + side, 1.0f) - larger(low, 0.0f) : 1.0f - far;
    const float bend = !TAPS && BENDS ? bend_of(far - 1.0f, 0.5f * side) - 2.0f * bend_of(far, 0.5f * side) : 0.0f;
    return (share > 0.0f ? share : 0.0f) + bend;
}

#if TAPS
// Blend the rows of the scene under a span into one, (BUFFER), from the column of `path` on.
INLINE void blend_rows(global const float *plane, const struct path path, const struct projection p, float *blended) {
    const uint inside = path.column >= 0 && path.column + BUFFER <= (int)p.scene_width;
    for (uint j = 0; j < BUFFER; j++) blended[j] = 0.0f;
    for (uint n = 0; n < path.rows; n++) {
        global const float *line = plane + (size_t)clamped(path.row + (int)n, p.scene_height) * p.scene_width;
        const float low = path.v - (float)(int)n;
        if (inside)
            for (uint j = 0; j < BUFFER; j++)
                blended[j] += share_of(low + path.v_slope * (float)(int)j, p.scale * SIDE) * line[path.column + (int)j];
        else
            for (uint j = 0; j < BUFFER; j++)
                blended[j] += share_of(low + path.v_slope * (float)(int)j, p.scale * SIDE) *
                              line[clamped(path.column + (int)j, p.scene_width)];
    }
}

// Read the photosites of a span, each over its square: value (SPAN).
INLINE void read_areas(global const float *plane, const struct path path, const struct projection p, float *value) {
    float blended[BUFFER];
    blend_rows(plane, path, p, blended);
    const float side = p.scale * SIDE;
    LANES
    for (uint i = 0; i < SPAN; i++) {
        const struct place at = across_at(path, (int)(STEP * i), p);
        const int first = at.pixel < BUFFER - READS ? at.pixel : BUFFER - READS;
        float sum = 0.0f;
        __attribute__((opencl_unroll_hint(READS)))
        for (int n = 0; n < READS; n++) sum += share_of(at.past - (float)n, side) * blended[first + n];
        value[i] = sum * (1.0f / (side * side));
    }
}
#else
// Read the photosites of a span, each across and then down at its own place: value (SPAN).
INLINE void read_areas(global const float *plane, const struct path path, const struct projection p, float *value) {
    for (uint i = 0; i < SPAN; i++) value[i] = 0.0f;
    for (uint n = 0; n < path.rows; n++) {
        global const float *line = plane + (size_t)clamped(path.row + (int)n, p.scene_height) * p.scene_width;
        for (uint i = 0; i < SPAN; i++) {
            const struct place at = across_at(path, (int)(STEP * i), p);
            const float low = (path.v - (float)(int)n) + path.v_slope * ((float)at.pixel + at.past), side = p.scale * SIDE;
            value[i] += share_of(low, side) * along(line, 1, 0, p.scene_width, path.column + at.pixel, at.past + 0.5f, 0.5f * side);
        }
    }
}
#endif

#if EVEN
#include "swept_even.h"
#endif
// Read the photosites of a span: value (SPAN).
INLINE void read_span(global const float *plane, const struct path path, const struct projection p, float *value) {
#if EVEN
    if (path.column > 0 && path.column + BUFFER <= (int)p.scene_width) read_even(plane, path, p, 0, value);
    else read_even(plane, path, p, 1, value);
#else
    read_areas(plane, path, p, value);
#endif
}

// Add a span at an instant to `sum` (SPAN), and close what it covers. value, cover: (SPAN) its light and coverage. weight: (SPAN). MEAN 1:
// what it lets through is added to `passed` (SPAN).
INLINE void add_span(const float *value, const float *cover, const float *weight, global float *open, float *passed, float *sum) {
    LANES
    for (uint i = 0; i < SPAN; i++) {
        const float through = FIRST ? 1.0f : open[i];
        sum[i] += weight[i] * through * value[i];
        if (MEAN) passed[i] += weight[i] * (through * (1.0f - cover[i]));
        else if (COVERED) open[i] = through * (1.0f - cover[i]);
    }
}

INLINE void write_open(const float *passed, global float *open) {
    for (uint i = 0; i < SPAN; i++) open[i] = passed[i];
}

#endif
