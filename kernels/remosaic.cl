// Remosaic: the code of each photosite in the colour that a Bayer pattern has there, from photosites of that colour around it in a pattern
// of groups. A photosite that has this colour keeps its code.
//
// codes: (height, width) uint16 [DN]; signal: (height, width) float32, without noise [DN], [e-], or variance [DN^2].
// mosaic: (height, width), the result, of the same kind and unit.
// weights: (PERIOD, PERIOD, TAPS, TAPS) float32, of the photosites around each place of the pattern, [row][column]; TAPS = 2 REACH + 1.
// first_x, first_y: place in the pattern of the frame's upper left photosite. white_dn, most: largest result; the least is 0.
// Beyond the frame's edge stands the photosite one period further in, which has the same colour. One work-item per photosite.
#include "plain_math.h"

#define TAPS (2 * REACH + 1)

// Row (or column) of the frame that stands at `place`, which may lie up to REACH, less than a period, outside.
INLINE int repeated(const int place, const int size) {
    return place < 0 ? place + PERIOD : (place >= size ? place - PERIOD : place);
}

#define SUM(values) \
    const int x = (int)get_global_id(0), y = (int)get_global_id(1), width = (int)get_global_size(0), height = (int)get_global_size(1); \
    const uint row = ((uint)y + first_y) % PERIOD, column = ((uint)x + first_x) % PERIOD; \
    global const float *own = weights + (row * PERIOD + column) * (TAPS * TAPS); \
    float sum = 0.0f; \
    for (int j = 0; j < TAPS; j++) { \
        const long line = (long)repeated(y + j - REACH, height) * width; \
        for (int i = 0; i < TAPS; i++) sum += own[j * TAPS + i] * (float)values[line + repeated(x + i - REACH, width)]; \
    } \
    sum = sum > 0.0f ? sum : 0.0f

kernel void remosaic_codes(global const ushort *restrict codes, global ushort *restrict mosaic, global const float *restrict weights,
                           const uint first_x, const uint first_y, const uint white_dn) {
    SUM(codes);
    const float nearest_dn = nearest(sum);
    mosaic[(long)y * width + x] = nearest_dn < (float)white_dn ? (ushort)nearest_dn : (ushort)white_dn;
}

kernel void remosaic_signal(global const float *restrict signal, global float *restrict mosaic, global const float *restrict weights,
                            const uint first_x, const uint first_y, const float most) {
    SUM(signal);
    mosaic[(long)y * width + x] = sum < most ? sum : most;
}
