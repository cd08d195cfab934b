"""What no fused kernel can beat: one Philox block per photosite and two bytes written; and the same without Philox."""

import numpy as np
from measuring.contest import Contestant

from simulator.device import Device
from simulator.device.kernel_source import expanded

SOURCE = """#include "philox.h"
kernel void probe(global const float *restrict light, global ushort *restrict raw, const uint width) {
    const uint x = get_global_id(0), y = get_global_id(1);
    const size_t index = (size_t)y * width + x;
#if RANDOM
    const struct words counter = {y, x, 0u, 0u};
    const struct words random = philox(counter, 1u, 0u);
    raw[index] = (ushort)((random.a ^ random.b) + (random.c ^ random.d)) + (ushort)(int)light[index];
#else
    raw[index] = (ushort)(int)light[index];
#endif
}
"""


def contestant(mean_e: np.ndarray, device: Device, random: bool, name: str) -> Contestant:
    """Reads 4 bytes and writes 2 per photosite, with or without a Philox block between."""
    height, width = mean_e.shape
    kernel = device.build(expanded(SOURCE), "probe", {"RANDOM": int(random)})
    light, codes = device.upload(mean_e), device.empty(mean_e.shape, np.uint16)
    row = max(size for size in range(1, device.row_px + 1) if width % size == 0)

    def run() -> None:
        device.run(kernel, (width, height), (row, 1), light=light, raw=codes, width=width)
        device.finish()

    return Contestant(name, run, lambda: device.download(codes, mean_e.shape, np.uint16), builds=True)
