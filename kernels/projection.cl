// Projection of the scene's grid onto photosites. A photosite, or a sample of one, is the mean over SAMPLES x SAMPLES points of its
// own square, each read bilinearly, or from the nearest pixel where NEAREST is 1. Beyond the grid its edge pixels continue.
//
// planes:  (channels, scene height, scene width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// mosaic:  (rows, columns) float32, each photosite's own colour (projection_mosaic).
// sampled: (planes, COLUMN_SETS, rows, set_columns) float32, every channel, in interleaved columns (projection_planes).
// radius:  (maps, COLUMN_SETS, rows, set_columns) float32, signed blur radius [photosites] in interleaved columns: scene_radius,
//          (scene height, scene width) float32 [photosites], read bilinearly at the sample's centre. Where the four pixels around it
//          differ by more than `edge` photosites they belong to two surfaces, and the nearest pixel is read (projection_radius).
// first_plane: plane or map of the output at which writing begins. origin_x, origin_y: photosite of the sensor at [0, 0] of the
// output; negative in a margin beyond the sensor.
#include "conventions.h"
#include "cfa.h"
#include "interleaved_columns.h"
#include "plain_math.h"
#if DISTORTION
#include "distortion.h"
#endif

// Where the sensor lies in the scene. Kernels take it as scalars: PoCL 3.1 vectorises over work-items 1.6 times worse with a struct.
struct projection {
    uint scene_width, scene_height; // of the scene's grid [px]
    float scale;                    // scene pixels per photosite
    float offset_x, offset_y;       // scene position of the sensor's upper left corner [px]
};

INLINE int clamped(const int i, const uint count) { return i < 0 ? 0 : (i < (int)count ? i : (int)count - 1); }

// Value of a plane at the scene position (u, v) [px]. Pixel i covers [i, i + 1), and its value is that at i + 1/2.
INLINE float point(global const float *plane, const float u, const float v, const struct projection p) {
#if NEAREST
    return plane[(size_t)clamped(whole(v), p.scene_height) * p.scene_width + clamped(whole(u), p.scene_width)];
#else
    const int left = whole(u - 0.5f), top = whole(v - 0.5f);
    const float s = (u - 0.5f) - (float)left, t = (v - 0.5f) - (float)top;
    const size_t x0 = clamped(left, p.scene_width), x1 = clamped(left + 1, p.scene_width);
    const size_t y0 = (size_t)clamped(top, p.scene_height) * p.scene_width, y1 = (size_t)clamped(top + 1, p.scene_height) * p.scene_width;
    const float upper = plane[y0 + x0] + s * (plane[y0 + x1] - plane[y0 + x0]);
    const float lower = plane[y1 + x0] + s * (plane[y1 + x1] - plane[y1 + x0]);
    return upper + t * (lower - upper);
#endif
}

// Turn a place on the sensor [photosites from its upper left corner] into the scene position [px] that a channel sees there.
INLINE void scene_place(float *x, float *y, const uint channel, const struct projection p) {
#if DISTORTION
    undistort(x, y, channel);
#endif
    *x = p.offset_x + p.scale * *x;
    *y = p.offset_y + p.scale * *y;
}

// Mean of a plane over a square of `size` photosites whose upper left corner lies at (x, y) on the sensor [photosites].
INLINE float square(global const float *plane, const float x, const float y, const float size, const uint channel,
                    const struct projection p) {
    float sum = 0.0f;
    for (uint j = 0; j < SAMPLES; j++)
        __attribute__((opencl_unroll_hint(8)))
        for (uint i = 0; i < SAMPLES; i++) {
            float u = x + size * (((float)i + 0.5f) * (1.0f / SAMPLES)), v = y + size * (((float)j + 0.5f) * (1.0f / SAMPLES));
            scene_place(&u, &v, channel, p);
            sum += point(plane, u, v, p);
        }
    return sum * (1.0f / (SAMPLES * SAMPLES));
}

// Dimension 0: columns of photosites; 1: rows.
kernel void projection_mosaic(global const float *restrict planes, global float *restrict mosaic, const uint scene_width,
                              const uint scene_height, const int origin_x, const int origin_y, const float scale,
                              const float offset_x, const float offset_y) {
    const struct projection projection = {scene_width, scene_height, scale, offset_x, offset_y};
    const size_t column = get_global_id(0), row = get_global_id(1);
    const uint channel = cfa_plane(column, row);
    const float x = (float)(origin_x + (int)column), y = (float)(origin_y + (int)row);
    mosaic[row * get_global_size(0) + column] =
        square(planes + (size_t)channel * scene_width * scene_height, x, y, 1.0f, channel, projection);
}

// Dimension 0: columns of a set; 1: rows of samples; 2: column sets of all channels.
kernel void projection_planes(global const float *restrict planes, global float *restrict sampled, const uint first_plane,
                              const uint scene_width, const uint scene_height, const int origin_x, const int origin_y,
                              const float scale, const float offset_x, const float offset_y) {
    const struct projection projection = {scene_width, scene_height, scale, offset_x, offset_y};
    const size_t column = get_global_id(0), row = get_global_id(1), set = get_global_id(2), channel = set / COLUMN_SETS;
    const float x = (float)origin_x + (float)(COLUMN_SETS * column + set % COLUMN_SETS) * (1.0f / OVER);
    const float y = (float)origin_y + (float)row * (1.0f / OVER);
    sampled[row_start(COLUMN_SETS * first_plane + set, row, get_global_size(1), get_global_size(0)) + column] =
        square(planes + channel * scene_width * scene_height, x, y, 1.0f / OVER, channel, projection);
}

// Dimension 0: columns of a set; 1: rows of samples; 2: column sets.
kernel void projection_radius(global const float *restrict scene_radius, global float *restrict radius, const float edge,
                              const uint first_plane, const uint scene_width, const uint scene_height, const int origin_x,
                              const int origin_y, const float scale, const float offset_x, const float offset_y) {
    const struct projection projection = {scene_width, scene_height, scale, offset_x, offset_y};
    const size_t column = get_global_id(0), row = get_global_id(1), set = get_global_id(2);
    float u = (float)origin_x + ((float)(COLUMN_SETS * column + set) + 0.5f) * (1.0f / OVER);
    float v = (float)origin_y + ((float)row + 0.5f) * (1.0f / OVER);
    scene_place(&u, &v, 1, projection);
    const int left = whole(u - 0.5f), top = whole(v - 0.5f);
    const float s = (u - 0.5f) - (float)left, t = (v - 0.5f) - (float)top;
    const size_t x0 = clamped(left, scene_width), x1 = clamped(left + 1, scene_width);
    const size_t y0 = (size_t)clamped(top, scene_height) * scene_width, y1 = (size_t)clamped(top + 1, scene_height) * scene_width;
    const float a = scene_radius[y0 + x0], b = scene_radius[y0 + x1], c = scene_radius[y1 + x0], d = scene_radius[y1 + x1];
    const float least = smaller(smaller(a, b), smaller(c, d)), greatest = larger(larger(a, b), larger(c, d));
    const float upper = a + s * (b - a), lower = c + s * (d - c);
    const float nearest_pixel = t < 0.5f ? (s < 0.5f ? a : b) : (s < 0.5f ? c : d);
    radius[row_start(COLUMN_SETS * first_plane + set, row, get_global_size(1), get_global_size(0)) + column] =
        greatest - least > edge ? nearest_pixel : upper + t * (lower - upper);
}
