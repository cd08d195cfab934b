// Lens blur of small circles in a scene finer than the photosites: the exact mean over a photosite's area and the image of the
// aperture, from the scene's pixels, each of them an even square (photosite_area.h). The aperture is a sum of rectangles:
//   light(x) = sum over rectangles k of share_k * mean of the scene over the photosite's square moved by all of s(x) * rectangle k,
// where a lens distorts or the image is turned of SPLIT x SPLIT upright parts of its parallelogram,
// in which the mean over a rectangle is separable and has a closed form. A surface that tilts moves the middle of its image by
// s grad(s) / 4 (simulator/optics/defocus/tilted_kernel.py, to the first order of the slope).
//
// planes:     (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// radius:     (maps, 2, map_rows, set_columns) float32, signed blur radius [photosites] in interleaved columns, OVER 1; GRADED 0: not
//             read, and each tile has its own.
// light:      (mosaics, height, width) float32 [e- s^-1 um^-2 sr^-1], of which one is made.
// tiles:      (tiles) struct gathered_tile. rectangles: (RECTANGLES) struct rectangle.
// pose:       as in projection.cl.
// TAPS:       most scene pixels on either axis that a part of a photosite and its blur circle touch. INSET: as in projection.cl.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "moved_interval.h"
#include "plain_math.h"
#include "photosite_area.h"

struct gathered_tile {
    int column, row; // first photosite in the frame; negative where it lies in the margin
    float radius;    // signed, of all its photosites [photosites]
};

// Part of the aperture.
struct rectangle {
    float x, y;             // its middle [pupil radii]
    float reach_x, reach_y; // half of its width and of its height [pupil radii]
    float share;            // of the aperture's area
};

struct gather {
    int origin_x, origin_y;   // photosite of the sensor at [0, 0] of the frame
    uint width, height;       // of the frame
    uint light_row;           // row of `light` at the frame's first row
    uint map;                 // of `radius`
    int map_column, map_row;  // photosite of the map at [0, 0] of the frame
    uint map_rows, set_columns; // rows of each map, and columns of each of its column sets
};

// Upper left corner of one of SPLIT x SPLIT parts of an area that is upright, each of which is `wide` and `tall` [px].
INLINE void part_of(const struct area area, const float wide, const float tall, const uint part, float *left, float *top) {
    const float m = (float)(part % SPLIT), n = (float)(part / SPLIT), middle = 0.5f * (SPLIT - 1);
    const float step_x = area.wide * (1.0f / SPLIT), step_y = area.tall * (1.0f / SPLIT);
    *left = area.left + 0.5f * (step_x - wide) + m * step_x + (n - middle) * (area.tilt_right * (1.0f / SPLIT));
    *top = area.top + 0.5f * (step_y - tall) + n * step_y + (m - middle) * (area.tilt_down * (1.0f / SPLIT));
}

// Dimension 0: columns of a tile; 1: its rows; 2: tiles.
kernel void scene_gather(global const float *restrict planes, global const float *restrict radius, global float *restrict light,
                         global const struct gathered_tile *restrict tiles, global const struct rectangle *restrict rectangles,
                         const uint scene_width, const uint scene_height, const float scale, const float offset_x,
                         const float offset_y, const struct gather frame, global const float *restrict pose) {
    const struct projection projection = projection_of(scene_width, scene_height, scale, offset_x, offset_y, pose);
    const struct gathered_tile tile = tiles[get_global_id(2)];
    const int column = tile.column + (int)get_global_id(0), row = tile.row + (int)get_global_id(1);
    if (column < 0 || row < 0 || column >= (int)frame.width || row >= (int)frame.height) return;
    float blur = tile.radius, tilt_x = 0.0f, tilt_y = 0.0f;
#if GRADED
    const int x = frame.map_column + column, y = frame.map_row + row;
    global const float *own = radius + row_start(2 * frame.map, (size_t)y, frame.map_rows, frame.set_columns);
    const size_t plane = (size_t)frame.map_rows * frame.set_columns;
    blur = own[(x & 1) * plane + (x >> 1)];
    tilt_x = 0.5f * (own[((x + 1) & 1) * plane + ((x + 1) >> 1)] - own[((x - 1) & 1) * plane + ((x - 1) >> 1)]);
    tilt_y = 0.5f * (own[(x & 1) * plane + (x >> 1) + frame.set_columns] - own[(x & 1) * plane + (x >> 1) - frame.set_columns]);
#endif
    const uint channel = cfa_plane((uint)column, (uint)row);
    global const float *plane_of_channel = planes + (size_t)channel * scene_width * scene_height;
    const float size = 1.0f - 2.0f * INSET;
    const int x_index = frame.origin_x + column, y_index = frame.origin_y + row;
    const struct displacement lens = moved_by_lens((float)x_index + 0.5f, (float)y_index + 0.5f, channel);
    const struct area turned = area_of(x_index, y_index, INSET, size, lens, projection);
    struct area area = upright(turned);
    const float side_x = extent(area.wide, area.tilt_right), side_y = extent(area.tall, area.tilt_down);
    const float across = side_x / size * blur, down = side_y / size * blur; // radius of the aperture's image [px]
    const float image_x = REACH * (across < 0.0f ? -across : across), image_y = REACH * (down < 0.0f ? -down : down);
    float aside, below, left, top;
    step_over(turned, size, blur, tilt_x, tilt_y, &aside, &below);
    area.left += 0.25f * aside, area.top += 0.25f * below;
    const float part_wide = side_x * (1.0f / SPLIT), part_tall = side_y * (1.0f / SPLIT);
    float sum = 0.0f, wide[TAPS], tall[TAPS];
    for (uint part = 0; part < SPLIT * SPLIT; part++) {
        part_of(area, part_wide, part_tall, part, &left, &top);
        const int first_x = whole(left - image_x), first_y = whole(top - image_y);
        for (uint k = 0; k < RECTANGLES; k++) {
            const struct rectangle image = rectangles[k];
            overlaps(left + across * image.x - (float)first_x, part_wide, image_x / REACH * image.reach_x, wide);
            overlaps(top + down * image.y - (float)first_y, part_tall, image_y / REACH * image.reach_y, tall);
            float seen = 0.0f;
            for (uint j = 0; j < TAPS; j++) {
                global const float *line = plane_of_channel + (size_t)clamped(area.row + first_y + (int)j, scene_height) * scene_width;
                float mean = 0.0f;
                for (uint i = 0; i < TAPS; i++) mean += wide[i] * line[clamped(area.column + first_x + (int)i, scene_width)];
                seen += tall[j] * mean;
            }
            sum += image.share * (1.0f / (SPLIT * SPLIT)) * seen;
        }
    }
    light[((size_t)frame.light_row + row) * frame.width + column] = sum;
}
