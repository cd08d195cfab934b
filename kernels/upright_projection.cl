// Projection of the scene's grid onto photosites where nothing displaces them: no lens that distorts, no pose. The mean over a photosite
// (photosite_area.h) is then one over rows and one over columns. The rows of the scene under a row of photosites are mixed first, side
// by side, and that line is read at the columns: READS scattered pixels for a photosite instead of READS * READS.
//
// planes: (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// mosaic: (rows, width) float32, each photosite's own colour, over its open area, INSET photosites from its border.
// origin_x, origin_y: photosite of the sensor at [0, 0]. pose: (13) float32, of which the last three are read (scene_place.h).
// SPAN, ROWS: columns and rows of photosites of a work-item. PITCH: whole scene pixels per photosite, rounded up. COLORS: planes of
// the colour filter array. TAPS, BENDS: photosite_area.h.
#include "cfa.h"
#include "photosite_area.h"
#ifndef CFA_COLUMNS
#define CFA_COLUMNS 2
#endif
#define READS (TAPS ? TAPS : BENDS ? 3 : 2)
#define LINE (SPAN * PITCH + READS + 2) // pixels of a mixed line: places are rounded
#define LINES (SPAN == 1 ? 1 : COLORS)
#if SPAN > 1
#define WIDE _Pragma("clang loop vectorize_width(16)")
#else
#define WIDE
#endif

// Shares of the READS pixels from the returned one on in the mean over the open part of a photosite, as `mixed` takes them, along one
// axis. start, step: of photosites in the scene in fixed point. number: of the photosite on the sensor.
INLINE int shares_at(const long start, const long step, const int number, const float scale, float *shares) {
    const float wide = scale * (1.0f - 2.0f * INSET);
    const struct place at = sample_place(TAPS ? start : start + step / 2, step, number);
#if TAPS
    const float begin = at.past + scale * INSET;
    const int first = whole(begin);
    const float low = begin - (float)first, high = low + wide;
    const float each = 1.0f / (high - low); // as rounded
    for (uint i = 0; i < TAPS; i++) shares[i] = overlap(low, high, i) * each;
    return at.pixel + first;
#elif BENDS
    const struct beside around = beside_of(at.pixel, at.past, 0.5f * wide);
    shares[0] = around.before, shares[2] = around.after;
    return around.own - 1;
#else
    const int first = whole(at.past - 0.5f);
    shares[1] = (at.past - 0.5f) - (float)first;
    return at.pixel + first;
#endif
}

// Mean of READS values, `step` apart, with these shares, `apart` apart.
INLINE float mixed(const float *values, const uint step, const float *shares, const uint apart) {
#if TAPS
    float sum = 0.0f;
    __attribute__((opencl_unroll_hint(TAPS))) for (uint i = 0; i < TAPS; i++) sum += shares[i * apart] * values[i * step];
    return sum;
#elif BENDS
    const float own = values[step];
    return own + (shares[0] * (values[0] - own) + shares[2 * apart] * (values[2 * step] - own));
#else
    return values[0] + shares[apart] * (values[step] - values[0]);
#endif
}

// Mix the rows from `row` on: `count` pixels from `column` on. Beyond the plane its edge pixels continue.
INLINE void mix_rows(global const float *plane, const struct projection p, const int column, const int count, const int row,
                     const float *shares, float *line) {
    size_t starts[READS];
    for (uint j = 0; j < READS; j++) starts[j] = (size_t)clamped(row + (int)j, p.scene_height) * p.scene_width;
#define MIX(place) { \
        float values[READS]; \
        for (uint j = 0; j < READS; j++) values[j] = plane[starts[j] + (size_t)(place)]; \
        line[k] = mixed(values, 1, shares, 1); \
    }
    const int is_inside = column >= 0 && column + count <= (int)p.scene_width;
    if (is_inside) { WIDE for (int k = 0; k < count; k++) MIX(column + k) }
    else for (int k = 0; k < count; k++) MIX(clamped(column + k, p.scene_width))
#undef MIX
}

// Dimension 0: spans of columns; 1: bands of ROWS rows.
kernel void upright_projection(global const float *restrict planes, global float *restrict mosaic, const uint width, const uint rows,
                               const uint scene_width, const uint scene_height, const int origin_x, const int origin_y,
                               const float scale, const float offset_x, const float offset_y, global const float *restrict pose) {
    const struct projection p = projection_of(scene_width, scene_height, scale, offset_x, offset_y, pose);
    const uint column = SPAN * (uint)get_global_id(0), first_row = ROWS * (uint)get_global_id(1);
    const uint columns = width - column < SPAN ? width - column : SPAN, end = rows - first_row < ROWS ? rows : first_row + ROWS;
    int reads[SPAN];
    float shares[READS * SPAN], line[LINES * LINE];
    for (uint i = 0; i < columns; i++) {
        float own[READS] = {0.0f};
        reads[i] = shares_at(p.start_x, p.step, origin_x + (int)(column + i), scale, own);
        for (uint j = 0; j < READS; j++) shares[j * SPAN + i] = own[j];
    }
    const int left = reads[0], count = reads[columns - 1] - left + READS;
    for (uint row = first_row; row < end; row++) {
        float down[READS];
        const int top = shares_at(p.start_y, p.step, origin_y + (int)row, scale, down);
        uint mixed_colors = 0;
        for (uint i = 0; i < (SPAN < CFA_COLUMNS ? SPAN : CFA_COLUMNS); i++) {
            const uint channel = cfa_plane(column + i, row);
            if (mixed_colors >> channel & 1u) continue;
            mixed_colors |= 1u << channel;
            global const float *plane = planes + (size_t)channel * scene_width * scene_height;
            mix_rows(plane, p, left, count, top, down, line + (LINES == 1 ? 0 : channel) * LINE);
        }
        global float *to = mosaic + (size_t)row * width + column;
        WIDE
        for (uint i = 0; i < columns; i++) {
            const uint channel = LINES == 1 ? 0 : cfa_plane(column + i, row);
            to[i] = mixed(line + (channel * LINE + (uint)(reads[i] - left)), 1, shares + i, SPAN);
        }
    }
}
