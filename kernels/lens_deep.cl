// Light of a deep picture behind a thin lens, by rays. A pixel of the scene holds any number of samples, each a card as large as the
// pixel, or a volume between two depths. A ray is followed through the pixels that it crosses, x + t u, and meets a card where its own
// radius reaches the card's: t = s + g (x + t u - centre), with the slope g of the surface that the card belongs to. Of a volume of
// alpha a it crosses the part f of the depths and loses 1 - (1 - a)^f there. Samples are composited front to back:
//     light = mean over rays of  sum_k c_k prod_{j<k} (1 - a_j)
// Of several layers, all that a ray meets in one lies over what it meets in the next, wherever they stand: it is followed through one
// after the other. Beyond the picture its edge pixels continue.
//
// starts:  (layers * scene height * scene width + 1) uint32, first sample of each pixel; samples of one stand from front to back.
// samples: (samples, 6) float32: signed blur radius s at the near and at the far end, equal for a card [photosites]; alpha;
//          -ln(1 - alpha), at most 80; slope g of a card to the right and down [photosites per scene pixel].
// colour:  (channels, samples) float32, electron radiance times alpha [e- s^-1 um^-2 sr^-1].
// spans:   (layers, 2) float32, least and greatest t at which a ray may meet a layer's samples.
// points, stops, places: as in lens_sampling.cl.
// light:   (photosites) float32, unit of colour: each photosite's own colour.
// Dimension 0: entries of `places`.
#include "cfa.h"
#include "lens_rays.h"
#if DISTORTION
#include "distortion.h"
#endif

struct deep_picture {
    uint width, height;         // of the scene [pixels]
    uint layers;                // over one another; 1 of a deep picture
    uint samples;               // of all pixels
    uint steps;                 // most pixels that a ray crosses
    float scale;                // scene pixels per photosite
    float offset_x, offset_y;   // scene position of the sensor's upper left corner [pixels]
    float reach;                // greatest |t| of rays, 1 or more [photosites of radius]
    float infinite;             // signed blur radius of infinite distance [photosites]
};

// Turn a place on the sensor [photosites] into the scene position [pixels] that a channel sees there.
INLINE void scene_position(float *x, float *y, const uint channel, const struct deep_picture picture) {
#if DISTORTION
    const struct displacement way = undistort(*x, *y, channel);
    *x += way.right, *y += way.down;
#endif
    *x = picture.offset_x + picture.scale * *x;
    *y = picture.offset_y + picture.scale * *y;
}

// t at which a ray leaves a row or column of pixels, counted from its start at `from`; infinity where it goes along it.
INLINE float leave(const int at, const float from, const float step) {
    return step > 0.0f ? ((float)(at + 1) - from) / step : step < 0.0f ? ((float)at - from) / step : 3.0e38f;
}

kernel void lens_deep(global const uint *restrict starts, global const float *restrict samples, global const float *restrict colour,
                      global const float *restrict spans, global const float *restrict points, global const float *restrict stops,
                      global const uint *restrict places, global float *restrict light, const struct deep_picture picture, const struct rays rays) {
    const uint place = places[get_global_id(0)], x_index = place % rays.width, y_index = place / rays.width;
    const uint channel = cfa_plane(x_index, y_index);
    const int sensor_x = rays.origin_x + (int)x_index, sensor_y = rays.origin_y + (int)y_index;
    global const float *point = points + (size_t)(place_bits((uint)sensor_x, (uint)sensor_y) % rays.patterns) * rays.samples * 4;
    uint taken = 0;
    float sum = 0.0f, lost = 0.0f; // Kahan's compensated sum
    for (uint i = 0; i < rays.samples; i++, point += 4) {
        float x = (float)sensor_x + point[0], y = (float)sensor_y + point[1];
#if STOPS
        const float field_y = rays.tangent_per_px * (y - rays.centre_y), field_x = rays.tangent_per_px * (x - rays.centre_x);
        if (!passes(stops, point[3], point[2], field_y, field_x)) continue;
#endif
        taken++;
        float end_x = x + picture.reach * point[2], end_y = y + picture.reach * point[3];
        scene_position(&end_x, &end_y, channel, picture);
        scene_position(&x, &y, channel, picture);
        const float step_x = (end_x - x) / picture.reach, step_y = (end_y - y) / picture.reach;
        float seen = 0.0f, through = 1.0f;
        for (uint layer = 0; layer < picture.layers && through > 1e-6f; layer++) {
            const size_t before = (size_t)layer * picture.height * picture.width;
            const float last = spans[2 * layer + 1];
            float t = spans[2 * layer];
            int column = whole(x + t * step_x), row = whole(y + t * step_y);
            for (uint step = 0; step < picture.steps && t < last && through > 1e-6f; step++) {
                const float leave_x = leave(column, x, step_x), leave_y = leave(row, y, step_y);
                const float end = smaller(larger(smaller(leave_x, leave_y), t), last);
                const size_t pixel = before + (size_t)clamped(row, picture.height) * picture.width + clamped(column, picture.width);
                const float off_x = x - ((float)column + 0.5f), off_y = y - ((float)row + 0.5f);
                for (uint k = starts[pixel]; k < starts[pixel + 1]; k++) {
                    global const float *own = samples + 6 * (size_t)k;
                    if (own[0] - end > 2.0f) break; // all behind lie beyond this pixel, also where they tilt
                    float part = own[2], share = 1.0f;
                    if (own[1] > own[0]) {
                        const float from = larger(t, own[0]), to = smaller(end, own[1]);
                        if (to <= from) continue;
                        const float middle = (picture.infinite - own[0]) * (picture.infinite - own[1]);
                        const float f = (to - from) / (own[1] - own[0]) * middle / ((picture.infinite - from) * (picture.infinite - to));
                        part = own[3] < 80.0f ? lost_share(smaller(f, 1.0f) * own[3]) : 1.0f;
                        share = own[2] > 1e-7f ? part / own[2] : f; // below, f is right to alpha / 2
                    } else {
                        const float met = (own[0] + own[4] * off_x + own[5] * off_y) / (1.0f - own[4] * step_x - own[5] * step_y);
                        if (met < t || met >= end) continue;
                    }
                    seen += through * share * colour[(size_t)channel * picture.samples + k];
                    through *= 1.0f - part;
                }
                if (leave_x <= leave_y) column += step_x > 0.0f ? 1 : -1;
                else row += step_y > 0.0f ? 1 : -1;
                t = end;
            }
        }
        const float added = seen - lost, next = sum + added;
        lost = (next - sum) - added;
        sum = next;
    }
    light[get_global_id(0)] = taken ? sum / (float)taken : 0.0f;
}
