// Image of layers that move as a whole and apart while the shutter is open, at photosites that an edge of a layer crosses: for each the mean
// over instants and over its open area of what it sees through nearer layers, where each layer is even squares. At an instant pixels of all
// layers lie alike beside those of the last one, so that their borders cut each of its pixels into LAYERS columns and rows of cells of even
// light. Cells are composited and added up over the photosites' height for a span, then over the width of each photosite.
// STEP 2: a mosaic behind a colour filter, even and odd columns apart. STEP 1: a plane of one colour.
//
// layer_0, layer_1, layer_2, layer_3: (planes, scene height, scene width) float32 of each of LAYERS layers, the nearest first: CHANNELS planes
//         of electron radiance times coverage [e- s^-1 um^-2 sr^-1]; and coverage, 0 to 1, but of the last. Those from LAYERS on are not read.
//         Beyond a layer its edge pixels continue.
// instants: (lines, instants) struct cells; one line, or one for each row of the launch.
// spans:  (spans) struct span, those that are written.
// mosaic: (rows, width) float32 from mosaic_row on, each photosite's own colour.
// WHOLE: pixels from a photosite of a span to the next, where these are whole; 0: they are not.
// WIDTH, HEIGHT: most pixels of the last layer that a photosite touches across and down. LINE: those that a span touches across.
#include "conventions.h"
#include "cfa.h"
#include "fixed_place.h"
#include "layer_rows.h"

struct span {
    int column, row; // of its first photosite on the sensor
};

struct frame {
    int origin_x, origin_y;         // photosite of the sensor at [0, 0] of the frame
    uint width;                     // of the frame [photosites]
    uint mosaic_row, colour;        // of the plane in `mosaic`; of the layers' planes (STEP 2: not read)
    uint instants, lines;           // of each line; of the table
    int first_row;                  // of the sensor, to which the first line belongs
    uint line_rows;                 // of each line
    uint scene_width, scene_height; // [px]
    float scale, offset_x, offset_y; // scene pixels per photosite; scene position of the sensor's upper left corner [px]
    float rests[3];                 // what float32 leaves of them
    float inset, side;              // of a photosite's open area from its border; its side [px]
};

// Dimension 0: spans.
kernel void layer_cells(global const float *restrict layer_0, global const float *restrict layer_1, global const float *restrict layer_2,
                        global const float *restrict layer_3, global const struct cells *restrict instants,
                        global const struct span *restrict spans, global float *restrict mosaic, const struct frame frame) {
    global const float *const planes[4] = {layer_0, layer_1, layer_2, layer_3};
    const struct span own = spans[get_global_id(0)];
    const int begin = own.column - frame.origin_x, row = own.row - frame.origin_y;
    const uint colour = STEP == 1 ? frame.colour : cfa_plane((uint)begin, (uint)row);
    const size_t line = frame.lines > 1 ? (size_t)(own.row - frame.first_row) / frame.line_rows * frame.instants : 0;
    const size_t pixels = (size_t)frame.scene_width * frame.scene_height;
    const long step = in_fixed_point(frame.scale, frame.rests[0]);
    const struct place x = sample_place(in_fixed_point(frame.offset_x, frame.rests[1]), step, own.column);
    const struct place y = sample_place(in_fixed_point(frame.offset_y, frame.rests[2]), step, own.row);
    float sum[SPAN], past[SPAN], lines[LAYERS][LINE];
    int pixel[SPAN];
    for (int i = 0; i < SPAN; i++) {
        const struct place place = sample_place(in_fixed_point(frame.offset_x, frame.rests[1]), step, own.column + (int)STEP * i);
        sum[i] = 0.0f, pixel[i] = place.pixel - x.pixel, past[i] = place.past;
    }
    for (uint k = 0; k < frame.instants; k++) {
        const struct cells cells = instants[line + k];
        const float shift = frame.inset + cells.right, down = y.past + (frame.inset + cells.down);
        const int begins = whole(x.past + shift), column = x.pixel + cells.column + begins, top = y.pixel + cells.row + whole(down);
        const float above = down - (float)whole(down);
        for (uint m = 0; m < LAYERS; m++)
            for (int i = 0; i < LINE; i++) lines[m][i] = 0.0f;
        for (int j = 0; j < HEIGHT; j++)
            for (uint q = 0; q < LAYERS; q++) {
                const float tall = shared((float)j + cells.below[q], (float)j + cells.below[q + 1], above, above + frame.side);
                for (uint m = 0; m < LAYERS && tall > 0.0f; m++) {
                    struct rows rows;
                    int inside = 1;
                    for (uint n = 0; n < LAYERS; n++) {
                        const int first = column + cells.left[4 * m + n];
                        const size_t at = (size_t)clamped(top + j + cells.above[4 * q + n], frame.scene_height) * frame.scene_width;
                        rows.first[n] = first, inside &= first >= 0 && first + LINE <= (int)frame.scene_width;
                        rows.light[n] = planes[n] + colour * pixels + at + first;
                        rows.cover[n] = planes[n] + (n + 1 < LAYERS ? CHANNELS : colour) * pixels + at + first;
                    }
                    if (inside) add_cells(rows, tall, 1, frame.scene_width, lines[m]);
                    else add_cells(rows, tall, 0, frame.scene_width, lines[m]);
                }
            }
        add_photosites(lines, cells.across, pixel, past, shift, begins, frame.side, cells.weight, sum);
    }
    for (int i = 0; i < SPAN; i++) {
        const uint at = (uint)(begin + (int)STEP * i); // wraps to a large number left of the frame
        if (at < frame.width) mosaic[((size_t)frame.mosaic_row + (size_t)row) * frame.width + at] = sum[i];
    }
}
