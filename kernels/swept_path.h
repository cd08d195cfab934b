// Where the photosites of a span of a row see the scene at an instant of a moving image: displacements that are a parabola along it.
#ifndef SWEPT_PATH_H
#define SWEPT_PATH_H
#include "plain_math.h"
#include "row_view.h"
#include "scene_place.h"
#define SIDE (1.0f - 2.0f * INSET)
#define REACH (0.5f * (float)(STEP * (SPAN - 1))) // from the middle of a span to its first and last photosite [photosites]
// Scene positions of a span's photosites, counted from the pixel [row][column]: those of their centres less half a pixel, or of the
// left and upper sides of their squares where TAPS > 0. u + (p.scale + u_drift) k + u_bend k (k - 2 REACH) at k photosites right of
// the first, v + v_slope u at u.
struct path {
    int column, row;
    uint rows;
    float u, u_drift, u_bend, v, v_slope;
};

// middle: of the span [photosites from the pivot]. column: first photosite of the span on the sensor. row: of the sensor.
INLINE struct path path_of(const struct view view, const float middle, const int column, const int row, const struct projection p) {
    const struct drift drift = drift_at(view, middle);
    const float reach = REACH, dx = drift.x, x_slope = drift.x_slope, dy = drift.y, y_slope = drift.y_slope;
    const float bend = -drift.bend * (1.0f + x_slope);
    const float into = TAPS ? INSET : 0.5f, centre = TAPS ? 0.0f : 0.5f;
    struct place across, down;
    displaced_place(p.start_x, p.step, column, p.scale, into, dx + reach * (reach * bend - x_slope), &across);
    displaced_place(p.start_y, p.step, row, p.scale, into, dy, &down);
    const float v = down.past - centre, side = p.scale * SIDE;
    const float extent = BENDS ? 0.5f * side : 0.0f; // TAPS 0: a photosite sees so far on either side
    const int left = whole(across.past - centre) - (!TAPS && BENDS ? 1 : 0);
    struct path path = {across.pixel + left, 0, 0u, (across.past - centre) - (float)left, p.scale * x_slope, p.scale * bend, v, 0.0f};
    path.v_slope = y_slope * (1.0f - x_slope * (1.0f - x_slope));
    const float tilt = reach * p.scale * (y_slope < 0.0f ? -y_slope : y_slope);
    const int top = whole(v - tilt - (TAPS ? 0.0f : extent));
    path.rows = (uint)(whole(v + tilt + (TAPS ? side : 1.0f + extent)) - top) + 1u;
    const float middle_px = path.u + reach * ((p.scale + path.u_drift) - reach * path.u_bend);
    path.v = (v - (float)top) - path.v_slope * (middle_px + (TAPS ? 0.5f * side - 0.5f : 0.0f));
    path.row = down.pixel + top;
    return path;
}

// Where the photosite k right of the first one sees the scene along its row [px].
INLINE struct place across_at(const struct path path, const int k, const struct projection p) {
    const float along = (float)k, bent_px = along * (along - 2.0f * REACH) * path.u_bend;
    const struct parted start = {0, path.u + bent_px}, step = {p.wide.whole, p.wide.rest + path.u_drift};
    const struct place at = parted_place(start, step, k, 0.0f);
    const int pixels = whole(at.past);
    const struct place found = {at.pixel + pixels, at.past - (float)pixels};
    return found;
}

#endif
