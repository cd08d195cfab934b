// Sharp image of a picture whose pixels move, each evenly along a straight line, while the shutter is open: for each photosite the
// mean over instants of the surface that is there. At an instant t the place p of a photosite's centre in the scene shows the pixel q
// with q + v(q) t = p. It is searched by fixed point, q = p - v(q) t, from several starts; of several the one of the smallest order
// covers. Where there is none, p shows what was hidden, and of the places that the searches reached that of the largest order is read.
//
// planes:  (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// vectors: (scene height, scene width, 3) float32, velocity to the right and down [scene px/s], order of the surface.
// starts:  (tile rows, tile columns, 2 STARTS) float32, for TILE x TILE scene pixels: how many starts count, 0, then for each start
//          after the first, q = p, the velocity [scene px/s] of q = p - v t.
// poses:   (lines, instants, 12) float32, weight, time on the clock [s], pivot and pose (scene_place.h), of the frame's rows, or of its
//          columns where COLUMNS is 1.
// mosaic:  (rows, width) float32, each photosite's own colour, over its open area.
#include "conventions.h"
#include "cfa.h"
#include "plain_math.h"
#define SPAN 1
#include "photosite_squares.h"
#define SIDE (1.0f - 2.0f * INSET)
#define TURNS 5    // steps of each search
#define FAR 1.0e7f // [px], beyond all pictures, whose edges continue; integers hold it

struct sweep {
    int origin_x, origin_y;         // photosite of the sensor at [0, 0] of the frame
    uint instants, scene_width, scene_height; // of each line; of the scene's grid [px]
    float scale, offset_x, offset_y, rests[3]; // px per photosite; scene position of the sensor's corner [px]; their float32 rests
};

INLINE float bounded(const float place, const float low, const float high) { return smaller(larger(place, low), high); }
INLINE float spread(const float a, const float b, const float c, const float d) {
    return larger(larger(a, b), larger(c, d)) - smaller(smaller(a, b), smaller(c, d));
}

struct surface {
    float right, down; // velocity [scene px/s]
    float order;
};

// The surface at the scene position (u, v) [px]: velocity between pixels that stay together until a time, else of the nearest.
INLINE struct surface surface_at(global const float *vectors, const float u, const float v, const float time, const struct projection p) {
    const float x = bounded(u, 0.0f, p.scene_width), y = bounded(v, 0.0f, p.scene_height);
    const int left = whole(x - 0.5f), top = whole(y - 0.5f);
    const float s = (x - 0.5f) - (float)left, t = (y - 0.5f) - (float)top;
    const size_t x0 = 3 * clamped(left, p.scene_width), x1 = 3 * clamped(left + 1, p.scene_width), row = 3 * (size_t)p.scene_width;
    const size_t y0 = clamped(top, p.scene_height) * row, y1 = clamped(top + 1, p.scene_height) * row;
    global const float *a = vectors + y0 + x0, *b = vectors + y0 + x1, *c = vectors + y1 + x0, *d = vectors + y1 + x1;
    global const float *own = t < 0.5f ? (s < 0.5f ? a : b) : (s < 0.5f ? c : d);
    const struct surface nearest = {own[0], own[1], own[2]};
    const float apart_px = larger(spread(a[0], b[0], c[0], d[0]), spread(a[1], b[1], c[1], d[1])) * size_of(time);
    if (apart_px >= NEAR_PX) return nearest;
    const float upper_x = a[0] + s * (b[0] - a[0]), upper_y = a[1] + s * (b[1] - a[1]);
    const float lower_x = c[0] + s * (d[0] - c[0]), lower_y = c[1] + s * (d[1] - c[1]);
    const struct surface between = {upper_x + t * (lower_x - upper_x), upper_y + t * (lower_y - upper_y), own[2]};
    return between;
}

// Turn a place (u, v) [scene px] at a time into that of the pixel that is there.
INLINE void trace_back(global const float *vectors, global const float *starts, const float time, const struct projection p,
                       float *u, float *v) {
    const float x = *u, y = *v;
    const uint columns = (p.scene_width + TILE - 1) / TILE, rows = (p.scene_height + TILE - 1) / TILE;
    const int column = clamped(whole(bounded(x, 0.0f, p.scene_width) * (1.0f / TILE)), columns);
    const int row = clamped(whole(bounded(y, 0.0f, p.scene_height) * (1.0f / TILE)), rows);
    global const float *own = starts + ((size_t)row * columns + column) * (2 * STARTS);
    const uint count = (uint)own[0];
    uint is_met = 0;
    float order = 0.0f;
    for (uint start = 0; start < STARTS; start++) {
        if (start >= count) continue;
        float a = start ? x - own[2 * start] * time : x, b = start ? y - own[2 * start + 1] * time : y;
        struct surface here = surface_at(vectors, a, b, time, p);
        for (uint turn = 0; turn < TURNS; turn++) {
            a = x - here.right * time, b = y - here.down * time;
            here = surface_at(vectors, a, b, time, p);
        }
        float next_x = x - here.right * time, next_y = y - here.down * time;
        const uint meets = size_of(next_x - a) < NEAR_PX && size_of(next_y - b) < NEAR_PX;
        const struct surface next = surface_at(vectors, next_x, next_y, time, p);
        if (!meets && next.order < here.order) next_x = a, next_y = b; // a search without an end goes to and fro between two
        const float reached = meets ? here.order : larger(here.order, next.order);
        if (start && (meets ? is_met && reached >= order : is_met || reached <= order)) continue;
        *u = bounded(next_x, -FAR, FAR), *v = bounded(next_y, -FAR, FAR), order = reached, is_met = meets;
    }
}

kernel void swept_vectors(global const float *restrict planes, global const float *restrict vectors, global const float *restrict starts,
                          global const float *restrict poses, global float *restrict mosaic, const struct sweep sweep) {
    const size_t column = get_global_id(0), row = get_global_id(1);
    const uint channel = cfa_plane((uint)column, row);
    global const float *plane = planes + channel * ((size_t)sweep.scene_width * sweep.scene_height);
    struct projection still = {sweep.scene_width, sweep.scene_height, sweep.scale, sweep.offset_x, sweep.offset_y};
    take_rests(&still, sweep.rests);
    const float x = (float)(sweep.origin_x + (int)column), y = (float)(sweep.origin_y + (int)row);
    struct displacements lens;
    see_through((int)x, 0, (int)y, INSET, SIDE, channel, &lens);
    float sum = 0.0f, lost = 0.0f;
    for (uint k = 0; k < sweep.instants; k++) {
        global const float *pose = poses + ((COLUMNS ? column : row) * sweep.instants + k) * (POSE_NUMBERS + 2);
        take_pose(&still, pose + 2);
        float u = x + 0.5f, v = y + 0.5f, value;
        scene_place(&u, &v, channel, still);
        float from_x = u, from_y = v;
        trace_back(vectors, starts, pose[1], still, &from_x, &from_y);
        struct projection moved = still;
        moved.start_x += in_fixed_point(from_x - u, 0.0f), moved.start_y += in_fixed_point(from_y - v, 0.0f);
        squares(plane, (int)x, 0, (int)y, INSET, SIDE, 1, &lens, 0, moved, &value);
        const float term = pose[0] * value - lost, total = sum + term; // lost: what rounding added (Kahan), of thousands of instants
        lost = (total - sum) - term, sum = total;
    }
    mosaic[row * get_global_size(0) + column] = sum;
}
