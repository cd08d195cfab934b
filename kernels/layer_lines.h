// Readings of a span of photosites of one row and colour, STEP photosites apart, of a layer at a place of its own (layer_spans.h): between
// two pixels of READS rows.
#ifndef LAYER_LINES_H
#define LAYER_LINES_H
#include "bilinear_area.h"
#define NEXT (EDGES ? STEP : 1)        // from the pixel of a photosite to that of the span's next; EDGES 0: every STEP-th column is in one set
#define PIXELS (STEP * (SPAN - 1) + 2 + DRIFTS) // of a line that a span reads
#define MIDDLE (0.5f * (float)(STEP * (SPAN - 1))) // from a span's first photosite to its middle [photosites]

// Place of a layer at an instant.
struct spot {
    int row;          // uppermost one that is read, from the row of the photosite's own number
    int left, right;  // two pixels that are read of each row, from the pixel of the photosite's own column
    int left_phase, right_phase; // begin of the planes that have them, from the layer's first [px]
    float past;       // between the two, 0 to 1
    float below;      // from where that row begins, 0 to 1 [px]
    float slope, bend, tilt; // DRIFTS 1: `past` and `below` are those of the middle; past + slope r + bend r^2, below + tilt r are
};                           // those at r photosites right of it, from 0 on, and in few spans above 1 [px per photosite]

// The same where two pixels beside each other are read of one row of each plane, READS 1.
struct row_spot {
    int row, left;    // the row, and the first of two pixels that are read of it
    int phase;        // begin of the planes that have them [px]
    float past;       // between the two, 0 to 1
};

INLINE struct spot spot_in_row(const struct row_spot at) {
    const struct spot found = {at.row, at.left, at.left + 1, at.phase, at.phase, at.past, 0.0f, 0.0f, 0.0f, 0.0f};
    return found;
}

// Where a row of photosites sees the scene at rest, EDGES 0.
struct row_place {
    int row;     // from the row of its own number
    float below; // from where that row begins, 0 to 1 [px]
};

// Shares of READS rows in the height of a photosite, whose place is `below` where the first of them begins (SQUARES, EDGES 1), or the
// second (bilinear light).
INLINE void shares_of(const float below, const float side, float *shares) {
#if READS == 1
    shares[0] = 1.0f;
#elif EDGES
    shares[0] = 1.0f - below, shares[1] = below;
#elif SQUARES
    __attribute__((opencl_unroll_hint(READS)))
    for (int n = 0; n < READS; n++) {
        const float share = smaller((float)(n + 1), below + side) - larger((float)n, below);
        shares[n] = (share > 0.0f ? share : 0.0f) / side;
    }
#else
    const struct beside at = beside_of(0, below, 0.5f * side);
    shares[0] = at.before, shares[1] = (1.0f - at.before) - at.after, shares[2] = at.after;
#endif
}

// Rows of a plane's pixels, at both pixels that the first photosite of a span reads; where some of a span's lie beyond the plane, the rows.
struct lines {
    global const float *left[READS + DRIFTS], *right[READS + DRIFTS];
};

INLINE float between(const float from, const float to, const float share) { return from + share * (to - from); }

INLINE struct lines lines_of(global const float *plane, const int row, const int left, const int right, const uint width,
                             const uint height) {
    struct lines found;
    __attribute__((opencl_unroll_hint(READS + DRIFTS)))
    for (int n = 0; n < READS + DRIFTS; n++) {
        global const float *line = plane + (size_t)clamped(row + n, height) * width;
        found.left[n] = line + left, found.right[n] = line + right;
    }
    return found;
}

// Where a column of a plane is in its rows: with EDGES 0 they are STEP sets of columns, one after the other.
INLINE int column_of(const int column, const uint width) {
    return EDGES ? column : column % STEP * ((int)width / STEP) + column / STEP;
}

// Mean of rows at a pixel `i` to the right of those of `line`.
INLINE float mixed(global const float *const *line, const int i, const float *shares) {
    float sum = shares[0] * line[0][i];
    __attribute__((opencl_unroll_hint(READS)))
    for (uint n = 1; n < READS; n++) sum += shares[n] * line[n][i];
    return sum;
}

// Mix rows into PIXELS pixels from column `first` on. Beyond the plane its edge pixels continue.
INLINE void mix_line(const struct lines at, const int first, const float *shares, const uint width, float *line) {
    const int begin = clamped(-first, PIXELS + 1), end = clamped((int)width - first, PIXELS + 1);
    const float left = mixed(at.left, 0, shares), right = mixed(at.left, (int)width - 1, shares);
    for (int j = 0; j < PIXELS; j++) line[j] = j < begin ? left : right;
    for (int j = begin; j < end; j++) line[j] = mixed(at.left, first + j, shares);
}

// Reading of photosite i of a span; edge: of lines that are mixed already. With EDGES 1 the second pixel is next to the first, of which
// compilers make vectors that are read together.
INLINE float read(const struct lines at, const float *line, const int edge, const uint i, const float *shares, const float past) {
    const float left = edge ? line[STEP * i] : mixed(at.left, NEXT * i, shares);
    const float own = EDGES ? mixed(at.left, STEP * i + 1, shares) : mixed(at.right, NEXT * i, shares);
    return between(left, edge ? line[STEP * i + 1] : own, past);
}

#endif
