// A band of rows of the frame with the margins that the blur reads, as the lens blur's kernels address it.
#ifndef ROW_BAND_H
#define ROW_BAND_H
#include "conventions.h"

struct row_band {
    uint sample_rows; // rows of samples in the band and its margins: OVER times its rows of photosites
    uint set_columns; // columns of each column set (interleaved_columns.h): half the band's columns of photosites
    int frame_x;      // column of the frame at the band's first photosite; negative where it lies in the margin left of the frame
    int frame_y;      // row of the frame at the band's first photosite; negative in the margin above the frame
    uint width;       // columns of the frame [photosites]
    uint height;      // rows of the frame [photosites]
    uint light_row;   // row of `light` at the frame's first row: 0 but where `light` is of several mosaics, one after the other
    uint channels;    // colour planes of a layer, before its plane of coverage
    uint cfa;         // colour planes of the filter's pattern of 2 x 2 photosites from the frame's upper left corner on, row by row, a byte each
};

// Colour plane of a photosite. across, down: from the band's first photosite. A number of the launch, so that all filters share a build.
INLINE uint band_color(const uint across, const uint down, const struct row_band band) {
    const uint column = (uint)band.frame_x + across, row = (uint)band.frame_y + down; // wrap in the margins
    return (band.cfa >> 8u * (2u * (row & 1u) + (column & 1u))) & 255u;
}

#endif
