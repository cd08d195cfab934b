// Which radii and coverages the samples of a layer have in each patch of a row band, and in each window of WINDOW_ROWS x
// WINDOW_COLUMNS patches. A block of photosites that looks through one point of the aperture reads samples within one window, so
// that occlusion.cl can leave out the slabs of radius that no sample there has.
//
// planes:  (layers, channels + COVERAGE, COLUMN_SETS, sample_rows, set_columns) float32, as in occlusion.cl.
// radius:  (maps, COLUMN_SETS, sample_rows, set_columns) float32, signed blur radius [photosites].
// patches: (layers, patch rows, patch columns) struct patch_window, of the patch alone; patches of PATCH_ROWS rows and HALF_PATCH
//          columns of all sets, from the band's first sample on.
// windows: the same, of the patches from this one on.
// layer, map: whose patches are written; map -1: a layer of constant radius, in all classes where it covers anything.
#include "conventions.h"
#include "interleaved_columns.h"
#include "patch_windows.h"
#include "radius_class.h"
#include "row_band.h"
#define WIDTH (4 * HALF_PATCH) // columns of a set that a work-item of patch_content reads: four patches

// Dimension 0: four patches side by side; 1: rows of patches.
kernel void patch_content(global const float *restrict planes, global const float *restrict radius,
                          global struct patch_window *restrict patches, const uint layer, const int map, const float first_class,
                          const float classes_per_unit, const struct row_band band) {
    const uint rows = band.sample_rows, columns = band.set_columns, top = (uint)get_global_id(1) * PATCH_ROWS * OVER;
    const uint end = top + PATCH_ROWS * OVER < rows ? top + PATCH_ROWS * OVER : rows;
    const size_t first = get_global_id(0) * WIDTH;
    global const float *own = radius + row_start(map < 0 ? 0 : COLUMN_SETS * map, 0, rows, columns) + first;
    global const float *coverage = planes + row_start(COLUMN_SETS * (layer * (band.channels + COVERAGE) + band.channels), 0, rows, columns) + first;
    float low[WIDTH], high[WIDTH], filled[WIDTH];
    uint near[WIDTH], far[WIDTH];
    for (uint i = 0; i < WIDTH; i++) {
        low[i] = high[i] = own[row_start(0, top, rows, columns) + i];
        filled[i] = 1.0f;
        near[i] = far[i] = 0u;
    }
    for (uint set = 0; set < COLUMN_SETS; set++)
        for (uint row = top; row < end; row++) {
            const size_t start = row_start(set, row, rows, columns);
            for (uint i = 0; i < WIDTH; i++) {
                const float value = own[start + i], cover = COVERAGE ? coverage[start + i] : 1.0f;
                low[i] = value < low[i] ? value : low[i];
                high[i] = value > high[i] ? value : high[i];
                filled[i] = cover < filled[i] ? cover : filled[i];
                const uint number = (uint)class_of(value, first_class, classes_per_unit), bit = 1u << (number & 31u);
                const uint any = cover > 0.0f ? 0xffffffffu : 0u;
                near[i] |= map < 0 ? any : number < 32u ? bit : 0u;
                far[i] |= map < 0 ? any : number < 32u ? 0u : bit;
            }
        }
    const size_t patch_columns = columns / HALF_PATCH, place = (layer * get_global_size(1) + get_global_id(1)) * patch_columns;
    for (uint patch = 0; patch < 4; patch++) {
        const uint from = patch * HALF_PATCH;
        for (uint i = from + 1; i < from + HALF_PATCH; i++) {
            low[from] = low[i] < low[from] ? low[i] : low[from];
            high[from] = high[i] > high[from] ? high[i] : high[from];
            filled[from] = filled[i] < filled[from] ? filled[i] : filled[from];
            near[from] |= near[i];
            far[from] |= far[i];
        }
        const struct patch_window found = {near[from], far[from], low[from], high[from], filled[from]};
        patches[place + 4 * get_global_id(0) + patch] = found;
    }
}

// Dimension 0: columns of patches; 1: rows of patches; 2: layers.
kernel void patch_windows(global const struct patch_window *restrict patches, global struct patch_window *restrict windows) {
    const size_t columns = get_global_size(0), rows = get_global_size(1), column = get_global_id(0), row = get_global_id(1);
    const size_t layer = get_global_id(2) * rows * columns;
    struct patch_window all = patches[layer + row * columns + column];
    for (size_t down = row; down < row + WINDOW_ROWS && down < rows; down++)
        for (size_t right = column; right < column + WINDOW_COLUMNS && right < columns; right++) {
            const struct patch_window one = patches[layer + down * columns + right];
            all.near |= one.near;
            all.far |= one.far;
            all.least = one.least < all.least ? one.least : all.least;
            all.greatest = one.greatest > all.greatest ? one.greatest : all.greatest;
            all.filled = one.filled < all.filled ? one.filled : all.filled;
        }
    windows[layer + row * columns + column] = all;
}
