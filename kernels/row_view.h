// Displacement of the image over a row of photosites at an instant, and around a place of it.
#ifndef ROW_VIEW_H
#define ROW_VIEW_H
#include "conventions.h"

// dx = (x + x_slope X - shrink X^2) / (1 + shrink X), dy = (y + y_slope X) / (1 + shrink X) at X photosites right of the pivot.
struct view {
    float x, x_slope; // [photosites], [photosites per photosite]
    float y, y_slope; // alike
    float shrink;     // [1 / photosites]
    float weight;     // of the instant in the row's light
};

// dx = x + x_slope r - bend (1 + x_slope) r^2, dy = y + y_slope r at r photosites right of the place.
struct drift {
    float x, x_slope, bend, y, y_slope;
};

// middle: the place [photosites from the pivot].
INLINE struct drift drift_at(const struct view view, const float middle) {
    const float turn = view.shrink * middle, part = 1.0f - turn * (1.0f - turn * (1.0f - turn)); // 1 / (1 + turn)
    const float bend = view.shrink * part;
    const float dx = (view.x + middle * (view.x_slope - view.shrink * middle)) * part;
    const float x_slope = (view.x_slope - 2.0f * view.shrink * middle) * part - bend * dx;
    const float dy = (view.y + middle * view.y_slope) * part, y_slope = view.y_slope * part - bend * dy;
    const struct drift found = {dx, x_slope, bend, dy, y_slope};
    return found;
}

#endif
