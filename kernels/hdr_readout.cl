// Combination of several readings of one frame, one launch a reading, from the one with the least gain or exposure to that with
// the most. One work-item per photosite.
//
// combine_codes: codes: (height, width) uint16, the reading [DN]. table: (white level + 1) uint16, combined and companded code of each
//   of its codes [DN]. combined: (height, width) uint16, replaced where the reading is below `switch_dn` and so not saturated.
// combine_noise_free: level: (height, width) float32, the reading without noise and rounding [DN]; black_dn, factor: its black
//   level and how much a DN of it is worth. combined: (height, width) float32 likewise, with black at combined_black_dn, from 0 to
//   combined_white_dn.
#include "plain_math.h"

kernel void combine_codes(global const ushort *restrict codes, global const ushort *restrict table, global ushort *restrict combined,
                          const uint switch_dn) {
    const size_t index = get_global_id(1) * get_global_size(0) + get_global_id(0);
    const ushort code = codes[index];
    if (code < switch_dn) combined[index] = table[code];
}

kernel void combine_noise_free(global const float *restrict level, global float *restrict combined, const float black_dn,
                               const float factor, const float combined_black_dn, const float combined_white_dn,
                               const float switch_dn) {
    const size_t index = get_global_id(1) * get_global_size(0) + get_global_id(0);
    const float level_dn = level[index];
    const float signal_dn = combined_black_dn + factor * (level_dn - black_dn);
    if (level_dn < switch_dn) combined[index] = larger(0.0f, smaller(signal_dn, combined_white_dn));
}
