// Means of the scene over squares of photosites (photosite_area.h): the places of up to BATCH of them are computed together, before the
// scene is read, so that compilers make vectors of the former.
#ifndef PHOTOSITE_SQUARES_H
#define PHOTOSITE_SQUARES_H
#include "lanes.h"
#include "photosite_area.h"
#ifndef BATCH
#define BATCH SPAN
#endif

// Areas of such squares (seen_area.h).
struct areas {
    int column[BATCH], row[BATCH];
    float left[BATCH], top[BATCH], wide[BATCH], tall[BATCH], tilt_right[BATCH], tilt_down[BATCH];
};
#if LEANS
#include "leaning_area.h"
#elif TAPS
#include "upright_area.h"
#endif

// Displacements by the lens of the middles of a span of squares.
struct displacements {
    float right[SPAN], down[SPAN], right_x[SPAN], right_y[SPAN], down_x[SPAN], down_y[SPAN];
};

// How far the lens moves what a channel sees in the middles of a span of such squares as those of `squares`.
INLINE void see_through(const int column, const int step, const int row, const float inset, const float size, const uint channel,
                        struct displacements *lens) {
    const float middle = inset + 0.5f * size, y = (float)row * (1.0f / OVER) + middle;
    LANES
    for (uint i = 0; i < SPAN; i++) {
        const struct displacement one = moved_by_lens((float)(column + (int)i * step * OVER) * (1.0f / OVER) + middle, y, channel);
        lens->right[i] = one.right, lens->right_x[i] = one.right_x, lens->right_y[i] = one.right_y;
        lens->down[i] = one.down, lens->down_x[i] = one.down_x, lens->down_y[i] = one.down_y;
    }
}

// Means of a plane over `count` squares of `size` photosites, up to BATCH, `inset` right of and below the corners of samples.
// column, row: of the first sample on the sensor, OVER to a photosite; the others lie `step` photosites apart to the right. lens: of
// see_through, for them from `first` on.
INLINE void squares(global const float *plane, const int column, const int step, const int row, const float inset, const float size,
                    const uint count, const struct displacements *lens, const uint first, const struct projection p, float *mean) {
#if TAPS || DISTORTION || POSE
    struct areas seen;
    LANES
    for (uint i = 0; i < count; i++) {
        const uint n = first + i;
        const struct displacement way = {lens->right[n],  lens->down[n],   lens->right_x[n], lens->right_y[n],
                                         lens->down_x[n], lens->down_y[n]};
        const struct area a = area_of(column + (int)i * step * OVER, row, inset, size, way, p);
        seen.column[i] = a.column, seen.left[i] = a.left, seen.wide[i] = a.wide, seen.tilt_right[i] = a.tilt_right;
        seen.row[i] = a.row, seen.top[i] = a.top, seen.tall[i] = a.tall, seen.tilt_down[i] = a.tilt_down;
    }
#endif
#if TAPS && LEANS
    leaning_means(plane, &seen, count, p, mean);
#elif TAPS
    upright_means(plane, &seen, count, p, mean);
#elif DISTORTION || POSE
    int from_x[BATCH], from_y[BATCH];
    float u[BATCH], v[BATCH];
    for (uint i = 0; i < count; i++) mean[i] = 0.0f;
    for (uint part = 0; part < SAMPLES * SAMPLES; part++) {
        const float across = ((float)(part % SAMPLES) + 0.5f) * (1.0f / SAMPLES);
        const float down = ((float)(part / SAMPLES) + 0.5f) * (1.0f / SAMPLES);
        for (uint i = 0; i < count; i++) {
            const float x = seen.left[i] + across * seen.wide[i] + (down - 0.5f) * seen.tilt_right[i];
            const float y = seen.top[i] + down * seen.tall[i] + (across - 0.5f) * seen.tilt_down[i];
            const int past_x = whole(x), past_y = whole(y);
            from_x[i] = seen.column[i] + past_x, from_y[i] = seen.row[i] + past_y, u[i] = x - (float)past_x, v[i] = y - (float)past_y;
        }
        for (uint i = 0; i < count; i++) {
            const float extent_u = smaller(extent(seen.wide[i], seen.tilt_right[i]) * (0.5f / SAMPLES), MOST_EXTENT);
            const float extent_v = smaller(extent(seen.tall[i], seen.tilt_down[i]) * (0.5f / SAMPLES), MOST_EXTENT);
            mean[i] += mean_around(plane, p.scene_width, p.scene_height, from_x[i], from_y[i], u[i], v[i], extent_u, extent_v);
        }
    }
    for (uint i = 0; i < count; i++) mean[i] *= 1.0f / (SAMPLES * SAMPLES);
#else
    const float extent = 0.5f * (p.scale * size);
    int from_x[BATCH], from_y[BATCH];
    float u[BATCH], v[BATCH];
    for (uint i = 0; i < count; i++) { // its middle: SAMPLES is 1
        const struct place right = parted_place(p.left, p.wide, column + (int)i * step * OVER, p.scale * (inset + 0.5f * size));
        const struct place below = sample_place(p.start_y + p.step / 2, p.step, row);
        from_x[i] = right.pixel, from_y[i] = below.pixel, u[i] = right.past, v[i] = below.past;
    }
    for (uint i = 0; i < count; i++)
        mean[i] = mean_around(plane, p.scene_width, p.scene_height, from_x[i], from_y[i], u[i], v[i], extent, extent);
#endif
}

#endif
