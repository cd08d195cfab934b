// The fused sensor kernel: all stages that act on each photosite independently, in physical order from light to code.
//
// input:      (frames, height, width) float32: electron radiance [e- s^-1 um^-2 sr^-1] in the colour of each photosite, from the
//             lens, or mean photoelectrons [e-] without IRRADIANCE and EXPOSURE; for PART == READOUT the collected electrons [e-].
// output:     (frames, height, width) uint16 codes [DN]; for PART == CHARGE float32 collected electrons [e-].
// tiles:      (tiles, 8) uint32: column and row of each tile's upper left corner in the stack, whose frames are stacked
//             vertically; x and y of that corner on the sensor [px], since random numbers depend on the position on the sensor;
//             the index of its frame in `seeds` and `numbers`; its columns and rows [px]; and which rows of each pair lie in the
//             frame (sensor_part.h). One work-group per pair of rows of a tile.
// seeds:      (frames, 2) uint32: frame seed and body seed.
// numbers:    (frames, NUMBERS) float32, the parameters of the stages; the host defines a macro STEM_FIELD for each
//             (simulator/sensor/kernel/kernel_program.py).
// spare:      (tiles, widest), for results of the other row, which is computed all the same.
// width:      of the frames; widest: of the tiles, each of which has AT_ONCE columns or more [px].
// The host defines each stage's name in capitals as 1 or 0; a stage at 0 is compiled out. PART: sensor_part.h.
#include "random_numbers.h"
#include "sensor_part.h"
#include "irradiance.h"
#include "exposure.h"
#include "prnu.h"
#include "photon_shot_noise.h"
#include "dead_pixels.h"
#include "dark_current.h"
#include "hot_pixels.h"
#include "full_well.h"
#include "dsnu.h"
#include "conversion_gain.h"
#include "read_noise_before_gain.h"
#include "random_telegraph_noise.h"
#include "analog_gain.h"
#include "column_offset.h"
#include "row_noise.h"
#include "banding.h"
#include "read_noise_after_gain.h"
#include "color_bias.h"
#include "nonlinearity.h"
#include "adc.h"
#include "digital_gain.h"

INLINE float charge(float signal, const uint x, const uint y, const float *normals, const uint *bits,
                    constant float *parameters) {
    if (IRRADIANCE) signal = irradiance(signal, x, y, parameters);
    if (EXPOSURE) signal = exposure(signal, parameters);
    if (PRNU) signal = prnu(signal, normals[RESPONSE], parameters);
    if (PHOTON_SHOT_NOISE) signal = photon_shot_noise(signal, normals[SHOT], bits[SHOT_COUNT]);
    if (DEAD_PIXELS) signal = dead_pixels(signal, bits[DEAD], parameters);
    if (DARK_CURRENT) signal = dark_current(signal, normals[DARK], bits[DARK_COUNT], parameters);
    if (HOT_PIXELS) signal = hot_pixels(signal, normals[HOT], bits, parameters);
    if (FULL_WELL) signal = full_well(signal, parameters);
    return signal;
}

INLINE float readout(float signal, const uint x, const uint y, const float *normals, const uint *bits,
                     const uint frame_seed, const uint body_seed, constant float *parameters) {
    if (DSNU) signal = dsnu(signal, normals[OFFSET], parameters);
    if (CONVERSION_GAIN) signal = conversion_gain(signal, parameters);
    if (READ_NOISE_BEFORE_GAIN) signal = read_noise_before_gain(signal, normals[BEFORE], x, y, body_seed, parameters);
    if (RANDOM_TELEGRAPH_NOISE) signal = random_telegraph_noise(signal, bits, parameters);
    if (ANALOG_GAIN) signal = analog_gain(signal, parameters);
    if (COLUMN_OFFSET) signal = column_offset(signal, normals[COLUMN], parameters);
    if (ROW_NOISE) signal = row_noise(signal, normals[ROW], parameters);
    if (BANDING) signal = banding(signal, y, frame_seed, parameters);
    if (READ_NOISE_AFTER_GAIN) signal = read_noise_after_gain(signal, normals[AFTER], parameters);
    if (COLOR_BIAS) signal = color_bias(signal, x, y, parameters);
    if (NONLINEARITY) signal = nonlinearity(signal, parameters);
    if (ADC) signal = adc(signal, parameters);
    if (DIGITAL_GAIN) signal = digital_gain(signal, parameters);
    return signal;
}

#include "row_pair.h"

// All stages at those columns. hot: whether one of these photosites may be.
#define PHOTOSITES(vectors, hot) COLUMNS(vectors, \
        expose_row_pair(above, below, column, x, y, frame_seed, body_seed, parameters, hot))

// Dimension 0 runs over a tile's columns, 1 over its pairs of rows, 2 over the tiles of this launch. On a CPU one work-item runs along
// the row (WORK_ITEMS is 1), on a GPU each takes a column.
kernel void sensor(global const float *restrict input, global result_type *restrict output, global result_type *restrict spare,
                   global const uint *restrict tiles, global const uint *restrict seeds, constant float *restrict numbers,
                   const uint width, const uint widest) {
    global const uint *tile = tiles + 8 * get_group_id(2);
    const uint which = tile[4], columns = tile[5], rows = tile[7];
    const size_t row = 2 * get_group_id(1), index = (tile[1] + row) * width + tile[0];
    if (row >= tile[6]) return; // of a lower tile than others of the launch
    const uint frame_seed = seeds[2 * which], body_seed = seeds[2 * which + 1];
    constant float *parameters = numbers + which * NUMBERS;
    const uint tile_x = tile[2], y = tile[3] + (uint)row;
    const size_t next = rows == BOTH_ROWS ? index + width : index;
    global result_type *unused = spare + get_group_id(2) * widest;
    const struct row above = {input + index, rows & FIRST_ROW ? output + index : unused};
    const struct row below = {input + next, rows & SECOND_ROW ? output + next : unused};
    for (size_t left = get_local_id(0); left < columns; left += AT_ONCE * WORK_ITEMS) {
        const size_t first = left + AT_ONCE <= columns ? left : columns - AT_ONCE; // the last vector begins within the one before
#if HOT_PIXELS // few of them: code that counts their electrons runs only where a vector has one
        uint hot[AT_ONCE];
        COLUMNS(WIDE, hot[column - first] = hot_rows(x, y, body_seed, parameters))
        size_t cold = 0; // columns before the first hot one
        while (cold < AT_ONCE && hot[cold] == 0u) cold++;
        if (cold < AT_ONCE) PHOTOSITES(NARROW, 1)
        else PHOTOSITES(WIDE, 0)
#else
        PHOTOSITES(WIDE, 0)
#endif
    }
}
