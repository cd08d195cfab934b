// Means of light that is bilinear between the centres of a scene's pixels. Along a line it bends at the centres alone, so that
//   mean over [m - h, m + h] = value at m + (after - 2 own + before) max(h - |m - c|, 0)^2 / (4 h)
// with c the nearest centre and h <= 1/2 (`extent`). BENDS 0: the value at m. Pixel i covers [i, i + 1), and its value is that at i + 1/2.
// A place is a pixel, and how far right of where it begins the middle m lies [px]: so it has the same bits far from the corner.
#ifndef BILINEAR_AREA_H
#define BILINEAR_AREA_H
#include "plain_math.h"
#define MOST_EXTENT 0.5f // [px]: photosites that are seen larger lie beyond the sensor

// What a bend of slope 1 at this distance adds to the mean.
INLINE float bend_of(const float distance, const float extent) {
    const float reached = larger(extent - (distance < 0.0f ? -distance : distance), 0.0f);
    return reached * reached * (0.25f / extent);
}

// Share of the pixels beside `own`, the one around the middle of an interval, in the mean over it; the rest is that of `own` itself.
struct beside {
    int own;
    float before, after;
};

INLINE struct beside beside_of(const int pixel, const float middle, const float extent) {
    const int own = whole(middle);
    const float past = (middle - (float)own) - 0.5f, bend = bend_of(past, extent);
    const struct beside found = {pixel + own, larger(-past, 0.0f) + bend, larger(past, 0.0f) + bend};
    return found;
}

// Mean of a line through the values of three pixels.
INLINE float bent(const float before, const float own, const float after, const struct beside at) {
    return own + (at.before * (before - own) + at.after * (after - own));
}

// Mean around `middle` of a line of `count` pixels, `step` values apart, of which `line` has those from `first` on.
INLINE float along(global const float *line, const size_t step, const int first, const uint count, const int pixel, const float middle,
                   const float extent) {
#if BENDS
    const struct beside at = beside_of(pixel, middle, extent);
    const float before = line[step * (size_t)(clamped(at.own - 1, count) - first)];
    return bent(before, line[step * (size_t)(clamped(at.own, count) - first)], line[step * (size_t)(clamped(at.own + 1, count) - first)], at);
#else
    const int past = whole(middle - 0.5f), left = pixel + past;
    const float own = line[step * (size_t)(clamped(left, count) - first)], next = line[step * (size_t)(clamped(left + 1, count) - first)];
    return own + ((middle - 0.5f) - (float)past) * (next - own);
#endif
}

// Mean of a plane (height, width) around (u, v) [px from where the pixel at column, line begins], v in [0, 1), over extent_u and extent_v
// to either side: across, then down. Were v any number, its shares would be made as those of u are, and compilers would pack the two
// into pairs, of which they make no vectors over work-items.
INLINE float mean_around(global const float *plane, const uint width, const uint height, const int column, const int line, const float u,
                         const float v, const float extent_u, const float extent_v) {
    const int past = BENDS ? 0 : whole(v - 0.5f), row = line + past;
    global const float *own = plane + (size_t)clamped(row, height) * width, *below = plane + (size_t)clamped(row + 1, height) * width;
    const float middle = along(own, 1, 0, width, column, u, extent_u), lower = along(below, 1, 0, width, column, u, extent_u);
#if BENDS
    const float upper = along(plane + (size_t)clamped(row - 1, height) * width, 1, 0, width, column, u, extent_u);
    const float off = v - 0.5f, bend = bend_of(off, extent_v);
    const struct beside at = {row, larger(-off, 0.0f) + bend, larger(off, 0.0f) + bend};
    return bent(upper, middle, lower, at);
#else
    return middle + ((v - 0.5f) - (float)past) * (lower - middle);
#endif
}

#endif
