// What the samples of a layer hold around a block that looks through one point of the aperture (patch_windows.cl, occlusion.cl).
#ifndef PATCH_WINDOWS_H
#define PATCH_WINDOWS_H
#include "conventions.h"

struct patch_window {
    uint near, far;        // 64 bits, one for each class of radii, set where a sample has one (radius_class.h)
    float least, greatest; // signed blur radius [photosites]
    float filled;          // least coverage
};

#define ROUNDED 0.01f // part of a class by which `class_of` may be wrong

// Whether radii from `least` on lie in no class before the one that goes from `first` to `last`.
INLINE int is_beyond(const float least, const float first, const float last) { return least > first + ROUNDED * (last - first); }

// Whether a sample of the window may lie in a slab of these radii that belongs to a class: the classes from the one before it to the
// next have its radii, or, where `own`, from its own one on. number: of the class; negative: a layer of constant radius. beside: how far aside
// of the slab its samples may lie, too, up to 20 [slabs]; width: of the slab.
INLINE int is_met(global const struct patch_window *window, const int number, const int own, const float beside, const float width, const float least, const float most) {
    const ulong held = (ulong)window->far << 32 | window->near;
    if (number < 0) return held != 0;
    const int more = (int)(beside + 0.999f), first = number - 1 - more;
    const ulong classes = ((ulong)1 << (3 + 2 * more)) - (own ? 2 : 1); // as many bits
    return (held & (first < 0 ? classes >> -first : classes << first)) != 0 && window->greatest >= least - beside * width && window->least < most + beside * width;
}

#endif
