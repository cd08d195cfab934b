// Sharp image of a scene that moves while the shutter is open: for each photosite the mean over instants of what it sees at each, every
// line of the sensor with its own instants. One launch adds one layer, the nearest first, which covers the next at each instant.
// STEP 2: a mosaic behind a colour filter, even and odd columns apart. STEP 1: planes of COLOURS colours, of photosites or samples of them.
//
// planes: (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1]; COVERED 1: and its coverage, 0 to 1.
// views:  swept_rows: (rows, instants) struct view (swept_area.h), of the frame's rows.
// poses:  swept_places: (lines, instants, 11) float32, weight, pivot and pose (scene_place.h), of the frame's rows, or of its columns
//         where COLUMNS is 1.
// open:   (instants, rows of the launch, STEP, set_columns) float32, light that nearer layers let through. FIRST 1: not read.
//         COVERED 0, the last layer: not written. MEAN 1: the mean over instants is written, for layers at rest behind, at one instant.
// mosaic: (rows, width) float32 from mosaic_row on, each photosite's own colour, over its open area; FIRST 0: what is there is added to.
// near_lamps: (rows, spans) uchar, whether a lamp passes a span of a row; LAMPS 0: not read, and all spans are computed.
#include "conventions.h"
#include "cfa.h"
#include "plain_math.h"
#define BATCH (COLUMNS ? 1 : SPAN) // photosites of a line, which have one pose
#include "photosite_squares.h"
#include "swept_area.h"

struct sweep {
    int origin_x, origin_y;         // photosite of the sensor at [0, 0] of the frame
    uint width;                     // of the frame [photosites]
    int first_column;               // of the first span in the frame; spans begin at multiples of STEP SPAN photosites of the sensor
    uint first_row;                 // of the launch in the frame
    uint mosaic_row;                // of the plane in `mosaic`
    uint colour, lamps, plane_rows; // of the first plane (STEP 2: not read); value of near_lamps that is computed; to the next plane
    uint set_columns;               // photosites of a row in each of STEP sets of columns, rounded up to whole spans
    uint instants, scene_width, scene_height; // of each line; of the scene's grid [px]
    float scale;                    // scene pixels per photosite
    float offset_x, offset_y, rests[3]; // scene position of the sensor's upper left corner [px]; what float32 leaves of the three
    float pivot_x, pivot_y;         // place on the sensor from which displacements are counted [photosites]
};

INLINE size_t open_row(const uint instant, const struct sweep sweep) {
    return (instant * get_global_size(1) + get_global_id(1)) * sweep.set_columns + get_global_id(0) * SPAN;
}

INLINE uint colour_of(const uint column, const size_t row, const struct sweep sweep) {
    return STEP == 1 ? sweep.colour : cfa_plane(column, (uint)row);
}

INLINE void write_span(const float *sum, const size_t row, const int first, const struct sweep sweep, global float *mosaic) {
    for (uint i = 0; i < SPAN; i++) {
        const uint column = (uint)(first + (int)(STEP * i)); // wraps to a large number left of the frame
        if (column >= sweep.width) continue;
        global float *photosite = mosaic + (sweep.mosaic_row + row) * sweep.width + column;
        *photosite = FIRST ? sum[i] : *photosite + sum[i];
    }
}

// Dimension 0: spans of a row's set of columns; 1: rows of the launch, each as STEP sets of columns. For displacements that change
// little along a span, without distortion.
kernel void swept_rows(global const float *restrict planes, global const struct view *restrict views, global float *restrict open,
                       global float *restrict mosaic, global const uchar *restrict near_lamps, const struct sweep sweep) {
    const size_t row = sweep.first_row + get_global_id(1) / STEP;
    if (LAMPS && near_lamps[row * get_global_size(0) + get_global_id(0)] != sweep.lamps) return;
    const int first = sweep.first_column + (int)(STEP * get_global_id(0) * SPAN + get_global_id(1) % STEP);
    const size_t pixels = (size_t)sweep.scene_width * sweep.scene_height;
    struct projection projection = {sweep.scene_width, sweep.scene_height, sweep.scale, sweep.offset_x, sweep.offset_y};
    take_rests(&projection, sweep.rests);
    const int x = sweep.origin_x + first, y = sweep.origin_y + (int)row;
    float value[SPAN], cover[SPAN] = {0.0f}, weight[SPAN], passed[SPAN] = {0.0f}, sum[COLOURS * SPAN] = {0.0f};
    for (uint k = 0; k < sweep.instants; k++) {
        const struct view view = views[row * sweep.instants + k];
        const struct path path = path_of(view, (float)x + (REACH + 0.5f) - sweep.pivot_x, x, y, projection);
        const uint is_read = !AT_REST || k == 0; // a layer at rest is read once
        for (uint i = 0; i < SPAN; i++) weight[i] = view.weight;
        if (COVERED == 1) { if (is_read) read_span(planes + CHANNELS * pixels, path, projection, cover); }
        for (uint n = 0; n < COLOURS; n++) {
            if (is_read) read_span(planes + (colour_of((uint)first, row, sweep) + n) * pixels, path, projection, value);
            add_span(value, cover, weight, open + open_row(k, sweep), passed, sum + n * SPAN);
        }
    }
    if (MEAN) write_open(passed, open + open_row(0, sweep));
    for (uint n = 0; n < COLOURS; n++) write_span(sum + n * SPAN, row + n * sweep.plane_rows, first, sweep, mosaic);
}

// The same for any displacement, distortion and lines.
kernel void swept_places(global const float *restrict planes, global const float *restrict poses, global float *restrict open,
                         global float *restrict mosaic, global const uchar *restrict near_lamps, const struct sweep sweep) {
    const size_t row = sweep.first_row + get_global_id(1) / STEP;
    const int first = sweep.first_column + (int)(STEP * get_global_id(0) * SPAN + get_global_id(1) % STEP);
    const size_t pixels = (size_t)sweep.scene_width * sweep.scene_height;
    struct projection projection = {sweep.scene_width, sweep.scene_height, sweep.scale, sweep.offset_x, sweep.offset_y};
    take_rests(&projection, sweep.rests);
    const uint channel = colour_of((uint)first, row, sweep);
    float value[SPAN], cover[SPAN], weight[SPAN], passed[SPAN], sum[SPAN];
    struct displacements lens;
    see_through(sweep.origin_x + first, STEP, sweep.origin_y + (int)row, INSET, SIDE, channel, &lens);
    for (uint i = 0; i < SPAN; i++) sum[i] = passed[i] = cover[i] = 0.0f;
    for (uint k = 0; k < sweep.instants; k++) {
        for (uint i = 0; i < SPAN; i += BATCH) {
            const uint own = (uint)(first + (int)(STEP * i)), column = !COLUMNS || own < sweep.width ? own : 0;
            global const float *pose = poses + ((COLUMNS ? column : row) * sweep.instants + k) * (POSE_NUMBERS + 1);
            take_pose(&projection, pose + 1);
            const int x = sweep.origin_x + (int)column, y = sweep.origin_y + (int)row;
            squares(planes + channel * pixels, x, STEP, y, INSET, SIDE, BATCH, &lens, i, projection, value + i);
            if (COVERED) squares(planes + CHANNELS * pixels, x, STEP, y, INSET, SIDE, BATCH, &lens, i, projection, cover + i);
            for (uint n = 0; n < BATCH; n++) weight[i + n] = pose[0];
        }
        add_span(value, cover, weight, open + open_row(k, sweep), passed, sum);
    }
    if (MEAN) write_open(passed, open + open_row(0, sweep));
    write_span(sum, row, first, sweep, mosaic);
}
