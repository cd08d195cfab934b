// Where the photosites of a block look through one point of aperture and time (occlusion.cl): all at one place beside their own; or, TURNS 1,
// where the picture turns or stretches, at a place that is bilinear in their column and row.
#ifndef BLOCK_VIEW_H
#define BLOCK_VIEW_H
#include "conventions.h"
#include "interleaved_columns.h"
#include "mosaic_colors.h"
#include "plain_math.h"
#include "row_band.h"
#define POINT (TURNS ? 17 : GROWS ? 9 : 5) // numbers of a point
#define BLOCK (TURNS ? 7 : 5)              // numbers of a block
#define SIZE (ROWS * SPAN) // photosites of a set: ROWS rows, two apart, of SPAN columns of a column set
#define ALL (SETS * SIZE)  // photosites of a work-item
#define BEYOND (LAMPS ? 0.0f : 0.25f) // farthest beyond its block's four samples that a photosite reads light as a straight line [samples]

// A place beside a photosite [samples], and its growth per photosite to the right, down, and both.
struct turned_place {
    float x, y, x_right, y_right, x_down, y_down, x_both, y_both;
};

struct block_view {
    float x, y;             // samples to the right and below of a photosite's first at which the left upper of its four lies; of the block's middle
    float u_x, u_y;         // point of the aperture there [pupil radii]
    int dx, dy;             // whole samples of x and y
    int left, top;          // samples to the right and below of the block's first at which it begins to read
    int held;               // whether a window of patches (patch_windows.h) holds all that it reads
    int wide;               // TURNS 1: whether photosites look apart by more than BEYOND, so that each reads samples of its own
    struct turned_place at; // TURNS 1: of the work-item's first photosite
    int column, row, start; // first sample of the work-item in the band, and its element
};

#if TURNS

// Whole number from `least` to `most`.
INLINE int limited(const int i, const int least, const int most) { return i < least ? least : i < most ? i : most; }

// The place seen from another photosite, so far to the right and down.
INLINE struct turned_place place_at(const struct turned_place t, const float right, const float down) {
    const struct turned_place found = {
        t.x + right * t.x_right + down * (t.x_down + right * t.x_both), t.y + right * t.y_right + down * (t.y_down + right * t.y_both),
        t.x_right + down * t.x_both, t.y_right + down * t.y_both, t.x_down + right * t.x_both, t.y_down + right * t.y_both, t.x_both, t.y_both};
    return found;
}

// A way of samples at which those from `first` to `last` of `count`, and the ones beside them, stay among these.
INLINE int within(const int way, const int first, const int last, const int count) { return limited(way, -first, count - 2 - last); }

// How far a bilinear way differs between the middle of so many columns and rows and their rim.
INLINE float spread_over(const float right, const float down, const float per_column, const float per_row, const float both) {
    return right * size_of(per_column) + down * size_of(per_row) + right * down * size_of(both);
}
#endif

// The view of a block for a slab of radius s. point, block: as in occlusion.cl. start: element of the work-item's first sample.
INLINE struct block_view view_block(global const float *point, global const uint *block, const float s, const long start, const struct row_band band) {
    struct block_view found = {0.0f, 0.0f, point[0], point[1], 0, 0, 0, 0, 1, 0, {0.0f}, 0, 0, (int)start};
    found.x = OVER * (s * point[0] + point[2] + 0.5f) - 0.5f, found.y = OVER * (s * point[1] + point[3] + 0.5f) - 0.5f;
    found.dx = found.left = whole(found.x), found.dy = found.top = whole(found.y);
#if GROWS && LAMPS
    found.left -= 1, found.top -= 1; // rows look up to a sample aside of the middle
#endif
#if TURNS
    const int columns = 2 * SPAN * (int)get_global_size(0), rows = 2 * ROWS * (int)get_global_size(1); // of the block
    const int sample_columns = COLUMN_SETS * (int)band.set_columns, sample_rows = (int)band.sample_rows;
    const int column = COLUMN_SETS * (int)block[0], row = OVER * (int)block[1]; // first sample
    const float right = 0.5f * (float)(columns - 1), down = 0.5f * (float)(rows - 1), over = OVER;
    const float from_x = as_float(block[5]) + right, from_y = as_float(block[6]) + down; // of the block's middle, from the cell's
    const struct turned_place of_cell = {found.x, found.y, over * (s * point[5] + point[7]), over * (s * point[6] + point[8]),
                                         over * (s * point[9] + point[11]), over * (s * point[10] + point[12]),
                                         over * (s * point[13] + point[15]), over * (s * point[14] + point[16])};
    const struct turned_place t = place_at(of_cell, from_x, from_y);
    const int first_column = 2 * SPAN * (int)get_global_id(0), first_row = 2 * ROWS * (int)get_global_id(1); // of the work-item
    found.x = t.x, found.y = t.y, found.at = place_at(t, (float)first_column - right, (float)first_row - down);
    found.u_x = point[0] + from_x * point[5] + from_y * (point[9] + from_x * point[13]);
    found.u_y = point[1] + from_x * point[6] + from_y * (point[10] + from_x * point[14]);
    found.dx = found.left = within(whole(t.x), column, column + OVER * (columns - 1), sample_columns);
    found.dy = found.top = within(whole(t.y), row, row + OVER * (rows - 1), sample_rows);
    found.column = column + OVER * first_column, found.row = row + OVER * first_row;
    const float apart_x = spread_over(right, down, t.x_right, t.x_down, t.x_both), apart_y = spread_over(right, down, t.y_right, t.y_down, t.y_both);
    found.wide = apart_x > BEYOND || apart_y > BEYOND;
    if (!found.wide) return found;
    const float width = spread_over(right, down, over + t.x_right, t.x_down, t.x_both), height = spread_over(right, down, t.y_right, over + t.y_down, t.y_both);
    found.left = within(whole(over * right + t.x - width), column, column, sample_columns);
    found.top = within(whole(over * down + t.y - height), row, row, sample_rows);
    found.held = 2.0f * width + 3.0f < OVER * 2 * HALF_PATCH * (WINDOW_COLUMNS - 1) && 2.0f * height + 3.0f < OVER * PATCH_ROWS * (WINDOW_ROWS - 1);
#endif
    return found;
}

#endif
