// The sensor: everything that acts on one photosite alone, in one pass. Read top to bottom, this is what happens to light.
//
// electron_radiance: (height, width) float32 [e- s^-1 um^-2 sr^-1] in the colour of each photosite, from the lens.
// raw:               (height, width) uint16 codes [DN].
// tiles:             (tiles, 2) uint32, upper left corner (x, y) of each tile in the frame; one work-group per row of a tile.
// parameters:        (n,) float32; the host defines a macro STEM_FIELD for each number (see simulator/fused.py).
// window_x, window_y: the frame's corner on the sensor [px]: random numbers belong to photosites, not to frames.
// A stage is compiled in when the host defines its name in capitals as 1.
#include "philox.h"
#include "normal.h"
#include "irradiance.h"
#include "exposure.h"
#include "photon_shot_noise.h"
#include "dark_current.h"
#include "full_well.h"
#include "read_noise_before_gain.h"
#include "analog_gain.h"
#include "read_noise_after_gain.h"
#include "adc.h"

#define STREAM_FRAME 0u // one Philox block serves shot noise (words a, b) and both read noises (words c, d)

// Dimension 0 runs over a tile's columns, 1 over its rows, 2 over the tiles of this launch, which are all of one shape.
kernel void sensor(global const float *restrict electron_radiance, global ushort *restrict raw, global const uint *restrict tiles,
                   constant float *restrict parameters, const uint width, const uint window_x, const uint window_y,
                   const uint frame_seed) {
    const size_t tile = get_group_id(2);
    const uint column = tiles[2 * tile] + get_local_id(0), row = tiles[2 * tile + 1] + get_group_id(1);
    const size_t index = (size_t)row * width + column;
    const uint x = column + window_x, y = row + window_y;

    const struct words counter = {y, x, 0u, STREAM_FRAME}; // y first: what a row has in common is then computed once for it
    const struct words random = philox(counter, frame_seed, 0u);
    const struct normals readout = normal_two(random.c, random.d);

    float signal = electron_radiance[index];
    signal = irradiance(signal, x, y, parameters);
    signal = exposure(signal, parameters);
#if PHOTON_SHOT_NOISE
    signal = photon_shot_noise(signal, random);
#endif
#if DARK_CURRENT
    signal = dark_current(signal, x, y, frame_seed, parameters);
#endif
#if FULL_WELL
    signal = full_well(signal, parameters);
#endif
#if READ_NOISE_BEFORE_GAIN
    signal = read_noise_before_gain(signal, readout.first, parameters);
#endif
#if ANALOG_GAIN
    signal = analog_gain(signal, parameters);
#endif
#if READ_NOISE_AFTER_GAIN
    signal = read_noise_after_gain(signal, readout.second, parameters);
#endif
#if ADC
    signal = adc(signal, parameters);
#endif
    raw[index] = (ushort)signal;
}
