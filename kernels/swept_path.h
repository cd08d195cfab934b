// Where the photosites of a span of a row see the scene at an instant of a moving image: displacements that are a parabola along it.
#ifndef SWEPT_PATH_H
#define SWEPT_PATH_H
#include "plain_math.h"
#include "row_view.h"
#include "scene_place.h"
#define SIDE (1.0f - 2.0f * INSET)
#define REACH (0.5f * (float)(STEP * (SPAN - 1))) // from the middle of a span to its first and last photosite [photosites]
// Scene positions of a span's photosites, counted from the pixel [row][column]: those of their centres less half a pixel, or of the
// left and upper sides of their squares where TAPS > 0. u = u + u_slope r + u_bend r^2 at r photosites right of the span's middle;
// v + v_slope j above the blended pixel j.
struct path {
    int column, row;
    uint rows;
    float u, u_slope, u_bend, v, v_slope;
};

// middle: of the span [photosites from the pivot]. column: first photosite of the span on the sensor. row: of the sensor.
INLINE struct path path_of(const struct view view, const float middle, const int column, const int row, const struct projection p) {
    const struct drift drift = drift_at(view, middle);
    const float bend = drift.bend, reach = REACH, dx = drift.x, x_slope = drift.x_slope, dy = drift.y, y_slope = drift.y_slope;
    const float into = TAPS ? INSET : 0.5f, centre = TAPS ? 0.0f : 0.5f;
    struct place across, down;
    displaced_place(p.start_x, p.step, column + (int)REACH, p.scale, into + (REACH - (float)(int)REACH), dx, &across);
    displaced_place(p.start_y, p.step, row, p.scale, into, dy, &down);
    const float u = across.past - centre, v = down.past - centre;
    struct path path = {0, 0, 0u, u, p.scale * (1.0f + x_slope), -p.scale * bend * (1.0f + x_slope), v, 0.0f};
    path.v_slope = y_slope * (1.0f - x_slope * (1.0f - x_slope));
    const float side = p.scale * SIDE, extent = BENDS ? 0.5f * side : 0.0f; // TAPS 0: a photosite sees so far on either side
    path.column = whole(u + reach * (reach * path.u_bend - path.u_slope)) - (!TAPS && BENDS ? 1 : 0);
    const float tilt = reach * p.scale * (y_slope < 0.0f ? -y_slope : y_slope);
    path.row = whole(v - tilt - (TAPS ? 0.0f : extent));
    path.rows = (uint)(whole(v + tilt + (TAPS ? side : 1.0f + extent)) - path.row) + 1u;
    path.u = u - (float)path.column;
    path.v = (v - (float)path.row) - path.v_slope * (path.u + (TAPS ? 0.5f * side - 0.5f : 0.0f));
    path.column += across.pixel, path.row += down.pixel;
    return path;
}

#endif
