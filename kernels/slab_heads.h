// Which slabs of a block's list its photosites may meet through one point of the aperture (occlusion.cl): HEADS of them at once, since
// compilers make a vector of them.
#ifndef SLAB_HEADS_H
#define SLAB_HEADS_H
#include "agreement.h"
#include "block_view.h"
#include "conventions.h"
#include "interleaved_columns.h"
#include "lanes.h"
#include "patch_windows.h"
#include "row_band.h"
#include "slab_light.h"
#include "slab_list.h"

#define HEADS (SPAN >= 16 && !TURNS ? SLAB_GROUP : 1) // one by one on GPUs, and where photosites look apart, for which there is more to compute

struct slab_heads {
    uint met[HEADS], window[HEADS];                 // whether a sample may lie in the slab; place of its window of patches
    float radius[HEADS], least[HEADS], most[HEADS]; // at which it is read; from which on and before which samples lie in it [photosites]
};

// The numbers of a block's point n, of one layer.
INLINE global const float *point_of(global const float *points, global const uint *block, const uint n, const int layer, const struct sampling sampling) {
    return points + POINT * ((size_t)block[4] + n + MOTION * layer * sampling.point_count);
}

// The next slabs of a block, from number `first` on and before `end`, seen through its point n. Arguments: of occlusion.cl; start: of `view_block`.
INLINE void find_slabs(struct slab_heads *heads, const uint first, const uint end, const uint n, global const uint *block, global const float *slabs,
                       global const float *points, global const struct patch_window *windows, const long start, const struct sampling sampling, const struct row_band band) {
    const uint patch_columns = (uint)band.set_columns / HALF_PATCH;
    global const float *numbers = slabs + slab_element(first); // of a whole group, or of one slab
    HEAD_LANES
    for (uint h = 0; h < HEADS; h++) {
        const float nearest = numbers[2 * SLAB_GROUP + h], border = numbers[3 * SLAB_GROUP + h], farthest = numbers[4 * SLAB_GROUP + h];
        const int layer = (int)numbers[h], is_mapped = numbers[SLAB_GROUP + h] >= 0.0f;
        global const float *point = point_of(points, block, n, layer, sampling);
        const float low = nearest + (border - nearest) * point[4], high = border + (farthest - border) * point[4];
        const float middle = 0.5f * (low + high), s = middle > -SHARP_PX && middle < SHARP_PX ? 0.0f : middle;
        const struct block_view view = view_block(point, block, s, start, band);
        const uint down = (OVER * block[1] + (uint)view.top) / (OVER * PATCH_ROWS), across = (COLUMN_SETS * block[0] + (uint)view.left) / (COLUMN_SETS * HALF_PATCH);
        const uint place = ((uint)layer * sampling.patch_rows + down) * patch_columns + across;
        const float least = is_mapped ? low - 0.25f * (high - low) : -1e30f, most = is_mapped ? high : 1e30f; // overlaps the slab in front, so that slopes show no gaps
        const float beside = MOTION && is_mapped ? beside_slab(view.u_x, view.u_y) : 0.0f;
        const int met = !view.held || is_met(windows + place, (int)numbers[5 * SLAB_GROUP + h], !MOTION && is_beyond(least, nearest, border), beside, high - low, least, most);
        heads->met[h] = met && first + h < end;
        heads->window[h] = place;
        heads->radius[h] = s, heads->least[h] = least, heads->most[h] = most;
    }
}

#endif
