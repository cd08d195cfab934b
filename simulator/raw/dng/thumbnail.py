"""Thumbnail of a DNG, which file browsers show."""

import numpy as np

from simulator.raw.disk_arrays import in_blocks
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa

LONG_SIDE_PX = 256


def thumbnail(raw: Raw) -> np.ndarray:
    """Bin the mosaic to at most 256 px a side: (height, width, 3) uint8.

    Blocks of the mosaic are averaged per colour, white-balanced by AsShotNeutral and encoded with
    gamma 1/2.2, without a colour matrix, so its colours are approximate.
    """
    pattern = Cfa.named(raw.cfa)
    cells = _cell_means(raw.dn[raw.active], pattern.period)
    signal = (cells - raw.black_level_dn) / max(raw.white_level_dn - raw.black_level_dn, 1)
    planes = []
    for channel in range(3):
        own = 0 if raw.cfa == "MONO" else channel
        sites = [signal[:, i, :, j] for i, row in enumerate(pattern.planes) for j, plane in enumerate(row) if plane == own]
        neutral = 1.0 if raw.cfa == "MONO" else raw.as_shot_neutral[channel]
        planes.append(sum(sites) / len(sites) / neutral)
    picture = np.clip(np.stack(planes, axis=-1), 0.0, 1.0) ** (1 / 2.2)
    return np.rint(255.0 * picture).astype(np.uint8)


def _cell_means(dn: np.ndarray, period: tuple[int, int]) -> np.ndarray:
    """Mean code per block and place in the colour pattern: (rows, period, columns, period)."""
    height, width = dn.shape
    step_y, step_x = (
        min(each * -(-max(height, width) // (each * LONG_SIDE_PX)), side // each * each)
        for each, side in zip(period, dn.shape, strict=True)
    )
    rows, columns = height // step_y, width // step_x
    # Rows are summed first: the sum then runs over contiguous memory, which is several times faster.
    kept = dn[: rows * step_y, : columns * step_x]
    sums = [
        block.reshape(-1, step_y // period[0], period[0], columns * step_x).sum(axis=1, dtype=np.uint32)
        for block in in_blocks(kept, step_y)
    ]
    cells = np.concatenate(sums).reshape(rows, period[0], columns, step_x // period[1], period[1])
    cells = np.einsum("ipjkq->ipjq", cells)  # a sixth of the time of `sum` where so few numbers lie side by side
    return cells / (step_y // period[0] * (step_x // period[1]))
