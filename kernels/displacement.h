// How far from a place on the sensor the place lies that it is seen at [photosites], and how that changes by a photosite to the right (x)
// and down (y).
#ifndef DISPLACEMENT_H
#define DISPLACEMENT_H
#include "conventions.h"

struct displacement {
    float right, down;
    float right_x, right_y, down_x, down_y;
};

// The same where another displacement follows, at the place that the first leads to.
INLINE struct displacement followed_by(const struct displacement first, const struct displacement next) {
    const struct displacement both = {
        first.right + next.right, first.down + next.down,
        first.right_x + next.right_x * (1.0f + first.right_x) + next.right_y * first.down_x,
        first.right_y + next.right_x * first.right_y + next.right_y * (1.0f + first.down_y),
        first.down_x + next.down_x * (1.0f + first.right_x) + next.down_y * first.down_x,
        first.down_y + next.down_x * first.right_y + next.down_y * (1.0f + first.down_y)};
    return both;
}

#endif
