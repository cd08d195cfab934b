// Classes of blur radii. A class is the whole part of classes_per_unit * asinh(radius / CLASS_UNIT), so that classes widen with the
// radius. CLASS_UNIT [photosites].
#ifndef RADIUS_CLASS_H
#define RADIUS_CLASS_H
#include "conventions.h"
#include "plain_math.h"

// Number of a radius's class [counted from first_class].
INLINE int class_of(const float value, const float first_class, const float classes_per_unit) {
    const float size = (value < 0.0f ? -value : value) * (1.0f / CLASS_UNIT), square = size * size + 1.0f;
    const float place = classes_per_unit * natural_log(size + square * reciprocal_square_root(square));
    return (int)((value < 0.0f ? -place : place) - first_class);
}

#endif
