// Light of a span of photosites of one row and colour, STEP photosites apart, at one instant of a moving image: displacements that are
// a parabola along the span, rows of the scene that are blended first, then read along the row. A photosite is read as in
// photosite_area.h: the mean of a fine scene over its open square (TAPS > 0), or a coarse scene bilinearly.
#ifndef SWEPT_AREA_H
#define SWEPT_AREA_H
#include "plain_math.h"
#include "photosite_area.h"
#define SIDE (1.0f - 2.0f * INSET)
#define REACH (0.5f * (float)(STEP * (SPAN - 1))) // from the middle of a span to its first and last photosite [photosites]
// Displacement of the image over a row at an instant: dx = (x + x_slope X - shrink X^2) / (1 + shrink X), dy = (y + y_slope X) /
// (1 + shrink X) at X photosites right of the pivot.
struct view {
    float x, x_slope; // [photosites], [photosites per photosite]
    float y, y_slope; // alike
    float shrink;     // [1 / photosites]
    float weight;     // of the instant in the row's light
};

// Scene positions of a span's photosites, counted from the pixel [row][column]: those of their centres less half a pixel, or of the
// left and upper sides of their squares where TAPS > 0. u = u + u_slope r + u_bend r^2 at r photosites right of the span's middle;
// v + v_slope j above the blended pixel j.
struct path {
    int column, row;
    uint rows;
    float u, u_slope, u_bend, v, v_slope;
};

// middle: of the span [photosites from the pivot]. x, y: place on the sensor of that side or centre of a photosite in the middle.
INLINE struct path path_of(const struct view view, const float middle, const float x, const float y, const struct projection p) {
    const float turn = view.shrink * middle, part = 1.0f - turn * (1.0f - turn * (1.0f - turn)); // 1 / (1 + turn)
    const float bend = view.shrink * part, reach = REACH;
    const float dx = (view.x + middle * (view.x_slope - view.shrink * middle)) * part;
    const float x_slope = (view.x_slope - 2.0f * view.shrink * middle) * part - bend * dx;
    const float dy = (view.y + middle * view.y_slope) * part, y_slope = view.y_slope * part - bend * dy;
    const float u = p.offset_x + p.scale * (x + dx) - (TAPS ? 0.0f : 0.5f), v = p.offset_y + p.scale * (y + dy) - (TAPS ? 0.0f : 0.5f);
    struct path path = {0, 0, 0u, u, p.scale * (1.0f + x_slope), -p.scale * bend * (1.0f + x_slope), v, 0.0f};
    path.v_slope = y_slope * (1.0f - x_slope * (1.0f - x_slope));
    path.column = whole(u + reach * (reach * path.u_bend - path.u_slope));
    const float tilt = reach * p.scale * (y_slope < 0.0f ? -y_slope : y_slope), side = p.scale * SIDE;
    path.row = whole(v - tilt);
    path.rows = (uint)(whole(v + tilt + (TAPS ? side : 1.0f)) - path.row) + 1u;
    path.u = u - (float)path.column;
    path.v = (v - (float)path.row) - path.v_slope * (path.u + (TAPS ? 0.5f * side - 0.5f : 0.0f));
    return path;
}

// Weight of a scene pixel that begins at `low`, counted from it, in a square of this side, or in a bilinear reading at `low`.
INLINE float share_of(const float low, const float side) {
    const float share = TAPS ? smaller(low + side, 1.0f) - larger(low, 0.0f) : 1.0f - (low < 0.0f ? -low : low);
    return share > 0.0f ? share : 0.0f;
}

// Blend the rows of the scene under a span into one, (BUFFER), from the column of `path` on.
INLINE void blend_rows(global const float *plane, const struct path path, const struct projection p, float *blended) {
    const uint inside = path.column >= 0 && path.column + BUFFER <= (int)p.scene_width;
    if (!TAPS && inside && path.rows == 2u) {
        global const float *upper = plane + (size_t)clamped(path.row, p.scene_height) * p.scene_width + path.column;
        global const float *lower = plane + (size_t)clamped(path.row + 1, p.scene_height) * p.scene_width + path.column;
        for (uint j = 0; j < BUFFER; j++)
            blended[j] = upper[j] + (path.v + path.v_slope * (float)(int)j) * (lower[j] - upper[j]);
        return;
    }
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

// Read the photosites of a span from its blended row: value (SPAN).
INLINE void read_blended(const float *blended, const struct path path, const struct projection p, float *value) {
    for (uint i = 0; i < SPAN; i++) {
        const float r = (float)(int)(STEP * i) - REACH, at = path.u + r * (path.u_slope + r * path.u_bend);
        const int wanted = (int)at, first = wanted < BUFFER - READS ? wanted : BUFFER - READS;
#if TAPS
        const float side = p.scale * SIDE;
        float sum = 0.0f;
        __attribute__((opencl_unroll_hint(READS)))
        for (int n = 0; n < READS; n++) sum += share_of(at - (float)(first + n), side) * blended[first + n];
        value[i] = sum * (1.0f / (side * side));
#else
        value[i] = blended[first] + (at - (float)first) * (blended[first + 1] - blended[first]);
#endif
    }
}

#if EVEN
#include "swept_even.h"
#endif
// Read the photosites of a span: value (SPAN).
INLINE void read_span(global const float *plane, const struct path path, const struct projection p, float *value) {
#if EVEN
    if (path.column > 0 && path.column + BUFFER <= (int)p.scene_width) {
        read_even(plane, path, p, value);
        return;
    }
#endif
    float blended[BUFFER];
    blend_rows(plane, path, p, blended);
    read_blended(blended, path, p, value);
}

#endif
