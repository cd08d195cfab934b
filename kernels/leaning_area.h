// Exact means of even squares over parallelograms, which photosites see where a lens distorts or the camera is posed. By Green's theorem
// what lies of one in a row of pixels left of a border is
//   sum over its four sides, around it, of how far up a side leads in the row * mean of max(border - x, 0) over that piece of it.
#ifndef LEANING_AREA_H
#define LEANING_AREA_H
#include "lanes.h"
#include "plain_math.h"
#include "ramp.h"
#include "scene_place.h"
#include "seen_area.h"
#define SIDES 4

// Part of a side between its ends, as a share of it.
INLINE float bounded_share(const float share) { return smaller(larger(share, 0.0f), 1.0f); }

// Means of a plane over `count` areas, up to BATCH, each of which touches at most TAPS pixels on either axis: those beyond the sensor that
// are seen larger are shrunk to that.
INLINE void leaning_means(global const float *plane, struct areas *seen, const uint count, const struct projection p, float *mean) {
    int column[BATCH], row[BATCH];
    float right[BATCH], before[BATCH], area[BATCH], x[SIDES][BATCH], y[SIDES][BATCH], steep[SIDES][BATCH], done[SIDES][BATCH];
    float height[SIDES][BATCH], at[SIDES][BATCH], swing[SIDES][BATCH], bend[SIDES][BATCH];
    LANES
    for (uint n = 0; n < count; n++) {
        const float across = size_of(seen->wide[n]) + size_of(seen->tilt_right[n]);
        const float down = size_of(seen->tall[n]) + size_of(seen->tilt_down[n]);
        const float most = larger(across, down), fit = most > (float)(TAPS - 1) ? (float)(TAPS - 1) / most : 1.0f;
        const float reach_x = 0.5f * fit * across, reach_y = 0.5f * fit * down;
        const float from_x = seen->left[n] + 0.5f * seen->wide[n] - reach_x, from_y = seen->top[n] + 0.5f * seen->tall[n] - reach_y;
        const float wide = fit * seen->wide[n], tilt_right = fit * seen->tilt_right[n];
        const float tall = fit * seen->tall[n], tilt_down = fit * seen->tilt_down[n];
        seen->wide[n] = wide, seen->tall[n] = tall, seen->tilt_right[n] = tilt_right, seen->tilt_down[n] = tilt_down;
        const int past_x = whole(from_x), past_y = whole(from_y);
        const float middle_x = (from_x - (float)past_x) + reach_x, middle_y = (from_y - (float)past_y) + reach_y;
        const float ways_x[SIDES] = {wide, tilt_right, -wide, -tilt_right}, ways_y[SIDES] = {tilt_down, tall, -tilt_down, -tall};
        column[n] = seen->column[n] + past_x, row[n] = seen->row[n] + past_y;
        right[n] = middle_x + reach_x;
        __attribute__((opencl_unroll_hint(SIDES)))
        for (uint k = 0; k < SIDES; k++) { // from its corner on
            x[k][n] = middle_x - 0.5f * (ways_x[k] - ways_x[(k + SIDES - 1) % SIDES]);
            y[k][n] = middle_y - 0.5f * (ways_y[k] - ways_y[(k + SIDES - 1) % SIDES]);
            steep[k][n] = 1.0f / (size_of(ways_y[k]) < LEAST_RANGE ? LEAST_RANGE : ways_y[k]);
            done[k][n] = bounded_share(-y[k][n] * steep[k][n]);
        }
        mean[n] = area[n] = 0.0f;
    }
    for (uint j = 0; j < TAPS; j++) {
        LANES
        for (uint n = 0; n < count; n++) {
            const float wide = seen->wide[n], tall = seen->tall[n], tilt_right = seen->tilt_right[n], tilt_down = seen->tilt_down[n];
            const float ways_x[SIDES] = {wide, tilt_right, -wide, -tilt_right}, ways_y[SIDES] = {tilt_down, tall, -tilt_down, -tall};
            const float turned = wide * tall < tilt_right * tilt_down ? 1.0f : -1.0f;
            __attribute__((opencl_unroll_hint(SIDES)))
            for (uint k = 0; k < SIDES; k++) {
                const float then = bounded_share(((float)(j + 1) - y[k][n]) * steep[k][n]), share = size_of(then - done[k][n]);
                at[k][n] = x[k][n] + ways_x[k] * (0.5f * (then + done[k][n]));
                swing[k][n] = larger(0.5f * size_of(ways_x[k]) * share, LEAST_RANGE);
                bend[k][n] = 0.25f / swing[k][n];
                height[k][n] = turned * ways_y[k] * share;
                done[k][n] = then;
            }
            before[n] = 0.0f;
        }
        for (uint i = 0; i < TAPS; i++) {
            LANES
            for (uint n = 0; n < count; n++) {
                const float border = smaller((float)(i + 1), right[n]); // nothing lies farther right
                float after = 0.0f;
                __attribute__((opencl_unroll_hint(SIDES)))
                for (uint k = 0; k < SIDES; k++) after += height[k][n] * ramp(border - at[k][n], swing[k][n], bend[k][n]);
                const float share = larger(after - before[n], 0.0f);
                const size_t line = (size_t)clamped(row[n] + (int)j, p.scene_height) * p.scene_width;
                mean[n] += share * plane[line + (size_t)clamped(column[n] + (int)i, p.scene_width)];
                area[n] += share;
                before[n] = after;
            }
        }
    }
    for (uint n = 0; n < count; n++) mean[n] /= area[n];
}

#endif
