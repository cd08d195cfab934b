// Means of the scene over squares of photosites (photosite_area.h): the places of up to BATCH of them are computed together, before the
// scene is read, so that compilers make vectors of the former.
#ifndef PHOTOSITE_SQUARES_H
#define PHOTOSITE_SQUARES_H
#include "photosite_area.h"

// Means of a plane over `count` squares of `size` photosites, up to BATCH, `inset` right of and below the corners of samples.
// column, row: of the first sample on the sensor, OVER to a photosite; the others lie `step` photosites apart to the right.
INLINE void squares(global const float *plane, const int column, const int step, const int row, const float inset, const float size,
                    const uint count, const uint channel, const struct projection p, float *mean) {
#if TAPS
    int from_x[BATCH], from_y[BATCH];
    float left[BATCH], top[BATCH], wide[BATCH], tall[BATCH], tilt_right[BATCH], tilt_down[BATCH];
    for (uint i = 0; i < count; i++) {
        const struct area a = area_of(column + (int)i * step * OVER, row, inset, size, channel, p);
        from_x[i] = a.column, from_y[i] = a.row, left[i] = a.left, top[i] = a.top, wide[i] = a.wide, tall[i] = a.tall, tilt_right[i] = a.tilt_right, tilt_down[i] = a.tilt_down;
    }
    for (uint i = 0; i < count; i++) {
        const struct area a = {from_x[i], from_y[i], left[i], top[i], wide[i], tall[i], tilt_right[i], tilt_down[i]};
        mean[i] = area_mean(plane, a, p);
    }
#else
    int from_x[BATCH], from_y[BATCH];
    float u[BATCH], v[BATCH], extent_u[BATCH], extent_v[BATCH];
    for (uint i = 0; i < count; i++) mean[i] = 0.0f;
    for (uint i = 0; i < count; i++) extent_u[i] = extent_v[i] = p.scale * size * (0.5f / SAMPLES);
#if BENDS && DISTORTION && !POSE
    for (uint i = 0; i < count; i++) {
        const struct area a = area_of(column + (int)i * step * OVER, row, inset, size, channel, p);
        extent_u[i] = a.wide * (0.5f / SAMPLES), extent_v[i] = a.tall * (0.5f / SAMPLES);
    }
#endif
    for (uint part = 0; part < SAMPLES * SAMPLES; part++) {
        const float across = size * (((float)(part % SAMPLES) + 0.5f) * (1.0f / SAMPLES));
        const float down = size * (((float)(part / SAMPLES) + 0.5f) * (1.0f / SAMPLES));
        for (uint i = 0; i < count; i++) {
#if DISTORTION || POSE
            struct place right, below;
            see_at(column + (int)i * step * OVER, row, inset + across, inset + down, channel, p, &right, &below);
            from_x[i] = right.pixel, u[i] = right.past, from_y[i] = below.pixel, v[i] = below.past;
#else
            const struct place right = parted_place(p.left, p.wide, column + (int)i * step * OVER, p.scale * (inset + across));
            const struct place below = sample_place(p.start_y + p.step / 2, p.step, row); // its middle: SAMPLES is 1
            from_x[i] = right.pixel, from_y[i] = below.pixel, u[i] = right.past, v[i] = below.past;
#endif
        }
        for (uint i = 0; i < count; i++)
            mean[i] += mean_around(plane, p.scene_width, p.scene_height, from_x[i], from_y[i], u[i], v[i], extent_u[i], extent_v[i]);
    }
    for (uint i = 0; i < count; i++) mean[i] *= 1.0f / (SAMPLES * SAMPLES);
#endif
}

#endif
