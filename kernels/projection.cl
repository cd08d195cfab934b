// Projection of the scene's grid onto photosites: each photosite averages SAMPLES x SAMPLES points of its own square,
// read bilinearly (or the nearest pixel, NEAREST). Outside the grid the edge pixel goes on.
//
// planes:  (channels, scene_height, scene_width) float32, electron radiance [e- s^-1 um^-2 sr^-1].
// mosaic:  (rows, columns) float32, the photosite's own colour only (kernel projection_mosaic).
// sampled: (channels, WAYS, rows, way_columns) float32, all colours, in the order of ways.h, for a lens blur (projection_planes).
// radius:  (WAYS, rows, way_columns) float32, in the same order: scene_radius (scene_height, scene_width) float32 [photosites] at the
//          point; the nearest scene pixel's where its neighbours lie more than `edge` apart (projection_radius).
//          Both are written from first_plane on.
// origin_x, origin_y: photosite on the sensor at [0, 0] of the output; negative in the margin a blur needs.
// DISTORTION: the photosite's place is that of a lens without distortion (distortion.h), in its own colour.
// scale: scene pixels per photosite. offset_x, offset_y: scene position [px] of the sensor's left and upper edge.
#include "conventions.h"
#include "cfa.h"
#include "plain_math.h"
#include "ways.h"
#if DISTORTION
#include "distortion.h"
#endif

INLINE int clamped(const int i, const uint count) { return i < 0 ? 0 : (i < (int)count ? i : (int)count - 1); }

// Value of a plane at (u, v) [px]; pixel i covers [i, i + 1) and its value stands at i + 1/2.
INLINE float point(global const float *plane, const float u, const float v, const uint scene_width, const uint scene_height) {
#if NEAREST
    return plane[(size_t)clamped(whole(v), scene_height) * scene_width + clamped(whole(u), scene_width)];
#else
    const int left = whole(u - 0.5f), top = whole(v - 0.5f);
    const float s = (u - 0.5f) - (float)left, t = (v - 0.5f) - (float)top;
    const size_t x0 = clamped(left, scene_width), x1 = clamped(left + 1, scene_width);
    const size_t y0 = (size_t)clamped(top, scene_height) * scene_width, y1 = (size_t)clamped(top + 1, scene_height) * scene_width;
    const float upper = plane[y0 + x0] + s * (plane[y0 + x1] - plane[y0 + x0]);
    const float lower = plane[y1 + x0] + s * (plane[y1 + x1] - plane[y1 + x0]);
    return upper + t * (lower - upper);
#endif
}

// Scene position [px] of a place on the sensor [photosites from its upper left corner], seen in one channel.
INLINE void scene_place(float *x, float *y, const uint channel, const float scale, const float offset_x, const float offset_y) {
#if DISTORTION
    undistort(x, y, channel);
#endif
    *x = offset_x + scale * *x;
    *y = offset_y + scale * *y;
}

// Mean of a square of `size` photosites whose upper left corner is (x, y) [photosites].
INLINE float square(global const float *plane, const float x, const float y, const float size, const uint channel,
                    const uint scene_width, const uint scene_height, const float scale, const float offset_x, const float offset_y) {
    float sum = 0.0f;
    for (uint j = 0; j < SAMPLES; j++)
        __attribute__((opencl_unroll_hint(8)))
        for (uint i = 0; i < SAMPLES; i++) {
            float u = x + size * (((float)i + 0.5f) * (1.0f / SAMPLES)), v = y + size * (((float)j + 0.5f) * (1.0f / SAMPLES));
            scene_place(&u, &v, channel, scale, offset_x, offset_y);
            sum += point(plane, u, v, scene_width, scene_height);
        }
    return sum * (1.0f / (SAMPLES * SAMPLES));
}

kernel void projection_mosaic(global const float *restrict planes, global float *restrict mosaic, const uint scene_width,
                              const uint scene_height, const int origin_x, const int origin_y, const float scale,
                              const float offset_x, const float offset_y) {
    const size_t column = get_global_id(0), row = get_global_id(1);
    const uint channel = cfa_plane(column, row);
    global const float *plane = planes + (size_t)channel * scene_width * scene_height;
    mosaic[row * get_global_size(0) + column] = square(plane, (float)(origin_x + (int)column), (float)(origin_y + (int)row), 1.0f,
                                                       channel, scene_width, scene_height, scale, offset_x, offset_y);
}

kernel void projection_planes(global const float *restrict planes, global float *restrict sampled, const uint scene_width,
                              const uint scene_height, const int origin_x, const int origin_y, const float scale,
                              const float offset_x, const float offset_y, const uint first_plane) {
    const size_t column = get_global_id(0), row = get_global_id(1), plane = get_global_id(2), channel = plane / WAYS;
    const float x = (float)origin_x + (float)(WAYS * column + plane % WAYS) * (1.0f / OVER);
    const float y = (float)origin_y + (float)row * (1.0f / OVER);
    sampled[((first_plane + plane) * get_global_size(1) + row) * get_global_size(0) + column] =
        square(planes + channel * scene_width * scene_height, x, y, 1.0f / OVER, channel, scene_width, scene_height, scale,
               offset_x, offset_y);
}

kernel void projection_radius(global const float *restrict scene_radius, global float *restrict radius, const uint scene_width,
                              const uint scene_height, const int origin_x, const int origin_y, const float scale,
                              const float offset_x, const float offset_y, const float edge, const uint first_plane) {
    const size_t column = get_global_id(0), row = get_global_id(1), way = get_global_id(2);
    float u = (float)origin_x + ((float)(WAYS * column + way) + 0.5f) * (1.0f / OVER);
    float v = (float)origin_y + ((float)row + 0.5f) * (1.0f / OVER);
    scene_place(&u, &v, 1, scale, offset_x, offset_y);
    const int left = whole(u - 0.5f), top = whole(v - 0.5f);
    const float s = (u - 0.5f) - (float)left, t = (v - 0.5f) - (float)top;
    const size_t x0 = clamped(left, scene_width), x1 = clamped(left + 1, scene_width);
    const size_t y0 = (size_t)clamped(top, scene_height) * scene_width, y1 = (size_t)clamped(top + 1, scene_height) * scene_width;
    const float a = scene_radius[y0 + x0], b = scene_radius[y0 + x1], c = scene_radius[y1 + x0], d = scene_radius[y1 + x1];
    const float least = smaller(smaller(a, b), smaller(c, d)), greatest = larger(larger(a, b), larger(c, d));
    const float upper = a + s * (b - a), lower = c + s * (d - c);
    const float nearest_pixel = t < 0.5f ? (s < 0.5f ? a : b) : (s < 0.5f ? c : d);
    radius[((first_plane + way) * get_global_size(1) + row) * get_global_size(0) + column] =
        greatest - least > edge ? nearest_pixel : upper + t * (lower - upper);
}
