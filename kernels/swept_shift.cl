// Sharp image of a picture that moves as a whole while the shutter is open, without a turn: the mean over time of its bilinear readings is
// one convolution with the weights of its path. The scene has one pixel for each photosite, or for each sample of one.
// STEP 2: a mosaic behind a colour filter, even and odd columns apart. STEP 1: a plane of one colour.
//
// planes: (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1]. Beyond it its edge pixels continue.
// taps:   (lines, tap_count) struct tap, pairs of adjacent pixels on the path and their weights; one line, or one for each `over` rows.
// mosaic: (rows, width) float32 from mosaic_row on, each photosite's own colour.
#include "conventions.h"
#include "cfa.h"
#include "bilinear_area.h"

struct tap {
    int row, column;   // of the left pixel, from the pixel of the photosite's own row and column
    float left, right; // weights
};

struct shift {
    int origin_x, origin_y;         // photosite of the sensor at [0, 0] of the frame
    uint width;                     // of the frame [photosites]
    int first_column;               // of the first span in the frame; spans begin at multiples of STEP SPAN photosites of the sensor
    uint first_row;                 // of the launch in the frame
    uint mosaic_row, colour;        // of the plane in `mosaic`; of `planes` (STEP 2: not read)
    uint tap_count, lines, over;    // of each line; of the launch; rows of each line where there are several
    uint scene_width, scene_height; // of the scene's grid [px]
};

// Dimension 0: spans of a row's set of columns; 1: rows of the launch, each as STEP sets of columns.
kernel void swept_shift(global const float *restrict planes, global const struct tap *restrict taps, global float *restrict mosaic,
                        const struct shift shift) {
    const size_t row = get_global_id(1) / STEP;
    const int begin = shift.first_column + (int)(STEP * get_global_id(0) * SPAN + get_global_id(1) % STEP);
    const uint colour = STEP == 1 ? shift.colour : cfa_plane((uint)begin, shift.first_row + (uint)row);
    global const float *plane = planes + (size_t)colour * shift.scene_width * shift.scene_height;
    global const struct tap *own = taps + (shift.lines > 1 ? row / shift.over : 0) * shift.tap_count;
    const int x = shift.origin_x + begin, y = shift.origin_y + (int)(shift.first_row + row);
    float sum[SPAN];
    for (uint i = 0; i < SPAN; i++) sum[i] = 0.0f;
    for (uint n = 0; n < shift.tap_count; n++) {
        const struct tap tap = own[n];
        const int first = x + tap.column;
        global const float *line = plane + (size_t)clamped(y + tap.row, shift.scene_height) * shift.scene_width;
        if (first >= 0 && first + STEP * SPAN < (int)shift.scene_width) {
            line += first;
            for (uint i = 0; i < SPAN; i++) sum[i] += tap.left * line[STEP * i] + tap.right * line[STEP * i + 1];
        } else
            for (uint i = 0; i < SPAN; i++) {
                const int at = first + (int)(STEP * i);
                sum[i] += tap.left * line[clamped(at, shift.scene_width)] + tap.right * line[clamped(at + 1, shift.scene_width)];
            }
    }
    for (uint i = 0; i < SPAN; i++) {
        const uint column = (uint)(begin + (int)(STEP * i)); // wraps to a large number left of the frame
        if (column < shift.width) mosaic[(shift.mosaic_row + shift.first_row + row) * shift.width + column] = sum[i];
    }
}
