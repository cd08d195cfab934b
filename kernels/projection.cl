// Projection of the scene's grid onto photosites. A photosite, or a sample of one, is the mean of the scene over its own square
// (photosite_area.h). Beyond the grid its edge pixels continue. SPAN: samples of a work-item along a row.
//
// planes:  (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// mosaic:  (rows, columns) float32, each photosite's own colour, over its open area, INSET photosites from its border
//          (projection_mosaic).
// sampled: (planes, COLUMN_SETS, rows, set_columns) float32, every channel, in interleaved columns (projection_planes).
// radius:  (maps, COLUMN_SETS, rows, set_columns) float32, signed blur radius [photosites] in interleaved columns: scene_radius,
//          (scene height, scene width) float32 [photosites], read bilinearly at the sample's centre. Where the four pixels around it
//          differ by more than EDGE photosites they belong to two surfaces, and the nearest pixel is read (projection_radius).
// first_plane: plane or map of the output at which writing begins. rows: rows of each plane of the output, of which the first ones are
// written. origin_x, origin_y: photosite of the sensor at [0, 0] of the output; negative in a margin beyond the sensor.
// pose: (13) float32, pivot and pose (scene_place.h), not read where POSE is 0; then what float32 leaves of scale, offset_x, offset_y.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "plain_math.h"
#include "photosite_squares.h"

// Dimension 0: spans of each of two sets of columns, as in a mosaic each has one colour in a row; 1: rows.
kernel void projection_mosaic(global const float *restrict planes, global float *restrict mosaic, const uint width, const uint scene_width,
                              const uint scene_height, const int origin_x, const int origin_y, const float scale,
                              const float offset_x, const float offset_y, global const float *restrict pose) {
    const struct projection projection = projection_of(scene_width, scene_height, scale, offset_x, offset_y, pose);
    const uint column = 2 * SPAN * (get_global_id(0) / 2) + get_global_id(0) % 2, row = get_global_id(1), channel = cfa_plane(column, row);
    const int x = origin_x + (int)column, y = origin_y + (int)row;
    float mean[SPAN];
    struct displacements lens;
    see_through(x, 2, y, INSET, 1.0f - 2.0f * INSET, channel, &lens);
    squares(planes + (size_t)channel * scene_width * scene_height, x, 2, y, INSET, 1.0f - 2.0f * INSET, SPAN, &lens, 0, projection, mean);
    for (uint i = 0; i < SPAN; i++)
        if (column + 2 * i < width) mosaic[(size_t)row * width + column + 2 * i] = mean[i];
}

// Dimension 0: spans of columns of a set; 1: rows of samples; 2: column sets of all channels.
kernel void projection_planes(global const float *restrict planes, global float *restrict sampled, const uint first_plane,
                              const uint rows, const uint scene_width, const uint scene_height, const int origin_x, const int origin_y,
                              const float scale, const float offset_x, const float offset_y, global const float *restrict pose) {
    const struct projection projection = projection_of(scene_width, scene_height, scale, offset_x, offset_y, pose);
    const size_t column = SPAN * get_global_id(0), row = get_global_id(1), set = get_global_id(2), channel = set / COLUMN_SETS;
    const int x = OVER * origin_x + (int)(COLUMN_SETS * column + set % COLUMN_SETS), y = OVER * origin_y + (int)row;
    global float *to = sampled + row_start(COLUMN_SETS * first_plane + set, row, rows, SPAN * get_global_size(0)) + column;
    float mean[SPAN];
    struct displacements lens;
    see_through(x, 2, y, 0.0f, 1.0f / OVER, channel, &lens);
    squares(planes + channel * scene_width * scene_height, x, 2, y, 0.0f, 1.0f / OVER, SPAN, &lens, 0, projection, mean);
    for (uint i = 0; i < SPAN; i++) to[i] = mean[i];
}

#if SAMPLES == 1 && TAPS == 0 && !DISTORTION
// A scene much coarser than its samples is read in two steps, with the bits of `projection_planes`: first across, at the
// columns of the samples, then down.
// across: (planes, COLUMN_SETS, scene rows from first_row on, set_columns) float32.

// Dimension 0: columns of a set; 1: scene rows; 2: column sets of all channels.
kernel void projection_across(global const float *restrict planes, global float *restrict across, const uint scene_width,
                              const uint scene_height, const uint first_row, const int origin_x, const float scale, const float offset_x,
                              global const float *restrict pose) {
    const size_t column = get_global_id(0), set = get_global_id(2), number = set / COLUMN_SETS * scene_height + first_row + get_global_id(1);
    const struct projection projection = projection_of(scene_width, scene_height, scale, offset_x, 0.0f, pose);
    const int sample = OVER * origin_x + (int)(COLUMN_SETS * column + set % COLUMN_SETS);
    const float extent = scale * (1.0f / OVER) * 0.5f;
    const struct place at = parted_place(projection.left, projection.wide, sample, extent);
    const float mean = along(planes + number * scene_width, 1, 0, scene_width, at.pixel, at.past, extent);
    across[row_start(set, get_global_id(1), get_global_size(1), get_global_size(0)) + column] = mean;
}

// Dimension 0: columns of a set; 1: rows of samples that are written, of `rows`; 2: column sets of all channels.
kernel void projection_down(global const float *restrict across, global float *restrict sampled, const uint first_plane,
                            const uint rows, const uint scene_height, const uint first_row, const uint across_rows, const int origin_y,
                            const float scale, const float offset_y, global const float *restrict pose) {
    const size_t column = get_global_id(0), row = get_global_id(1), set = get_global_id(2), columns = get_global_size(0);
    const struct projection projection = projection_of(0, scene_height, scale, 0.0f, offset_y, pose);
    const float extent = scale * (1.0f / OVER) * 0.5f;
    const struct place at = sample_place(projection.start_y + projection.step / 2, projection.step, OVER * origin_y + (int)row);
    global const float *line = across + row_start(set, 0, across_rows, columns) + column;
    const float mean = along(line, columns, (int)first_row, scene_height, at.pixel, at.past, extent);
    sampled[row_start(COLUMN_SETS * first_plane + set, row, rows, columns) + column] = mean;
}
#endif

// Dimension 0: spans of columns of a set; 1: rows of samples; 2: column sets.
kernel void projection_radius(global const float *restrict scene_radius, global float *restrict radius, const uint first_plane,
                              const uint rows, const uint scene_width, const uint scene_height,
                              const int origin_x, const int origin_y, const float scale, const float offset_x, const float offset_y,
                              global const float *restrict pose) {
    struct projection projection = {scene_width, scene_height, scale, offset_x, offset_y};
    take_pose(&projection, pose);
    const size_t column = SPAN * get_global_id(0), row = get_global_id(1), set = get_global_id(2);
    float u[SPAN], v[SPAN];
    for (uint i = 0; i < SPAN; i++) {
        float x = (float)origin_x + ((float)(COLUMN_SETS * (column + i) + set) + 0.5f) * (1.0f / OVER);
        float y = (float)origin_y + ((float)row + 0.5f) * (1.0f / OVER);
        scene_place(&x, &y, 1, projection);
        u[i] = x - 0.5f, v[i] = y - 0.5f;
    }
    global float *to = radius + row_start(COLUMN_SETS * first_plane + set, row, rows, SPAN * get_global_size(0)) + column;
    for (uint i = 0; i < SPAN; i++) {
        const int left = whole(u[i]), top = whole(v[i]);
        const float s = u[i] - (float)left, t = v[i] - (float)top;
        const size_t x0 = clamped(left, scene_width), x1 = clamped(left + 1, scene_width);
        const size_t y0 = (size_t)clamped(top, scene_height) * scene_width, y1 = (size_t)clamped(top + 1, scene_height) * scene_width;
        const float a = scene_radius[y0 + x0], b = scene_radius[y0 + x1], c = scene_radius[y1 + x0], d = scene_radius[y1 + x1];
        const float least = smaller(smaller(a, b), smaller(c, d)), greatest = larger(larger(a, b), larger(c, d));
        const float upper = a + s * (b - a), lower = c + s * (d - c);
        const float nearest_pixel = t < 0.5f ? (s < 0.5f ? a : b) : (s < 0.5f ? c : d);
        to[i] = greatest - least > EDGE ? nearest_pixel : upper + t * (lower - upper);
    }
}
