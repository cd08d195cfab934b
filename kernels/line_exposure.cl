// Line exposure: what each line of the sensor collects of the light, relative to the line that collects most. Lines differ where
// a shutter opens them for different times, or where light changes while they are open one after the other.
//
// mosaic: (height, width) float32, electron radiance; line_exposure multiplies it by the shares, in place.
// light:  (height, width) float32, electron radiance of another lamp; add_line_exposure adds its shares to the mosaic.
// shares: (height) float32 where lines are rows, else (width): 0 to 1, of the lines of the mosaic.
// ROWS: 1 where lines are rows, 0 where they are columns, 2 where one share is that of all. One work-item per photosite.
#include "conventions.h"

#if ROWS == 1
#define LINE row
#elif ROWS == 0
#define LINE column
#else
#define LINE 0
#endif

kernel void line_exposure(global float *restrict mosaic, global const float *restrict shares) {
    const size_t column = get_global_id(0), row = get_global_id(1), here = row * get_global_size(0) + column;
    mosaic[here] = mosaic[here] * shares[LINE];
}

kernel void add_line_exposure(global float *restrict mosaic, global const float *restrict light, global const float *restrict shares) {
    const size_t column = get_global_id(0), row = get_global_id(1), here = row * get_global_size(0) + column;
    mosaic[here] = mosaic[here] + light[here] * shares[LINE];
}
