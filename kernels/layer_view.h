// Where photosites of a block see a layer of one blur radius through a point of the aperture, and what they read there (layer_pair.h).
#ifndef LAYER_VIEW_H
#define LAYER_VIEW_H
#include "block_view.h"
#include "conventions.h"
#include "interleaved_columns.h"
#include "row_band.h"
#define SHARP_PX (OVER == 1 ? 0.5f : 0.0f) // blur circles inside their sample do not blur
#define ASIDE (OVER == 1 ? 1 : 2) // place among `columns` of an odd column's first
#define COLUMN_PLACES (ASIDE + 2)

// Where the photosites of a work-item see a layer through a point: elements to the samples to the left and the right, of those in even
// and in odd columns, in the row above that of even rows; and the bilinear weights.
struct layer_view {
    long columns[COLUMN_PLACES];
    float wa, wb, wc, wd;
};

INLINE void view_layer(struct layer_view *view, global const float *point, global const uint *block, const float radius, const struct row_band band) {
    const float s = radius > -SHARP_PX && radius < SHARP_PX ? 0.0f : radius;
    const struct block_view at = view_block(point, block, s, 0, band);
    const long plane = (long)band.sample_rows * band.set_columns, row = (long)at.dy * band.set_columns;
    const float f = at.x - (float)at.dx, g = at.y - (float)at.dy;
    for (int i = 0; i < COLUMN_PLACES; i++) view->columns[i] = row + column_start(at.dx + (i < 2 ? i : OVER + i - ASIDE), plane);
    view->wa = (1.0f - f) * (1.0f - g), view->wb = f * (1.0f - g), view->wc = (1.0f - f) * g, view->wd = f * g;
}

// A plane as the photosite at this element of a set sees it.
INLINE float read_plane(global const float *plane, const struct layer_view *v, const long element, const uint set, const long set_columns) {
    const uint down = OVER * (set / 2), across = ASIDE * (set % 2);
    global const float *above = plane + element + down * set_columns, *below = plane + element + (down + 1) * set_columns;
    const long left = v->columns[across], right = v->columns[across + 1];
    return v->wa * above[left] + v->wb * above[right] + v->wc * below[left] + v->wd * below[right];
}

#endif
