// What the samples of a layer hold around a block that looks through one point of the aperture (patch_windows.cl, occlusion.cl).
#ifndef PATCH_WINDOWS_H
#define PATCH_WINDOWS_H
#include "conventions.h"

struct patch_window {
    uint near, far;        // 64 bits, one for each class of radii, set where a sample has one (radius_class.h)
    float least, greatest; // signed blur radius [photosites]
    float filled;          // least coverage
};

// Whether a sample of the window may lie in a slab of these radii that belongs to a class: the classes from the one before it to the
// next have its radii. number: of the class; negative: a layer of constant radius.
INLINE int is_met(global const struct patch_window *window, const int number, const float least, const float most) {
    const ulong held = (ulong)window->far << 32 | window->near;
    if (number < 0) return held != 0;
    return ((number > 0 ? held >> (number - 1) : held << 1) & 7) != 0 && window->greatest >= least && window->least < most;
}

#endif
