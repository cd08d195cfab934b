"""Thumbnail of a DNG, which file browsers show."""

import numpy as np

from simulator.raw.disk_arrays import in_blocks
from simulator.raw.raw_image import Raw

LONG_SIDE_PX = 256


def thumbnail(raw: Raw) -> np.ndarray:
    """Bin the mosaic to at most 256 px a side: (height, width, 3) uint8.

    Blocks of the mosaic are averaged per colour, white-balanced by AsShotNeutral and encoded with
    gamma 1/2.2, without a colour matrix, so its colours are approximate.
    """
    colours = "W" * 4 if raw.cfa == "MONO" else raw.cfa
    signal = (_cell_means(raw.dn[raw.active]) - raw.black_level_dn) / max(raw.white_level_dn - raw.black_level_dn, 1)
    planes = []
    for channel, colour in enumerate("RGB"):
        sites = [signal[:, row, :, column] for row in (0, 1) for column in (0, 1) if colours[2 * row + column] in (colour, "W")]
        neutral = 1.0 if raw.cfa == "MONO" else raw.as_shot_neutral[channel]
        planes.append(sum(sites) / len(sites) / neutral)
    picture = np.clip(np.stack(planes, axis=-1), 0.0, 1.0) ** (1 / 2.2)
    return np.rint(255.0 * picture).astype(np.uint8)


def _cell_means(dn: np.ndarray) -> np.ndarray:
    """Mean code per block and place in the 2x2 colour pattern: (rows, 2, columns, 2)."""
    height, width = dn.shape
    step = 2 * -(-max(height, width) // (2 * LONG_SIDE_PX))
    step_y, step_x = min(step, height // 2 * 2), min(step, width // 2 * 2)
    rows, columns = height // step_y, width // step_x
    # Rows are summed first: the sum then runs over contiguous memory, which is several times faster.
    kept = dn[: rows * step_y, : columns * step_x]
    sums = [
        block.reshape(-1, step_y // 2, 2, columns * step_x).sum(axis=1, dtype=np.uint32) for block in in_blocks(kept, step_y)
    ]
    cells = np.concatenate(sums)
    return cells.reshape(rows, 2, columns, step_x // 2, 2).sum(axis=3) / (step_y * step_x / 4)
