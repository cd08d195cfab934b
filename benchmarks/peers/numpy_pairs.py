"""The loop that people write: pairs from photographs with NumPy alone, each photograph decoded once and kept in memory.

It does less than a data set of ours: one camera at one ISO, no tone curve, no colour matrix, highlights that are not kept, no
flips, no seeds, no facts about the sample. K = 1.5 DN/e-, read noise 4 DN, 15871 DN from black to white.
"""

from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

from simulator.scene.pixel_file import read_pixels

K, READ_DN, RANGE_DN, GAINS = 1.5, 4.0, 15871.0, np.array([0.5, 0.9, 0.6], np.float32)
LINEAR = np.array([v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in np.arange(256) / 255], np.float32)


class NumpyPairs(Dataset):
    """Pairs of 4 x side/2 x side/2 from random crops of the JPEGs of a folder."""

    def __init__(self, folder: Path, count: int, side: int) -> None:
        self.files, self.count, self.side = sorted(folder.glob("*.jpg")), count, side
        self.decoded: dict[int, np.ndarray] = {}

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> dict[str, np.ndarray]:
        rng = np.random.default_rng(index)
        number = int(rng.integers(len(self.files)))
        if number not in self.decoded:
            self.decoded[number] = read_pixels(self.files[number], "picture").pixels
        picture, side = self.decoded[number], self.side
        y, x = (int(rng.integers(extent - side)) for extent in picture.shape[:2])
        rgb = LINEAR[picture[y : y + side, x : x + side]] * GAINS
        clean = np.stack([rgb[::2, ::2, 0], rgb[::2, 1::2, 1], rgb[1::2, ::2, 1], rgb[1::2, 1::2, 2]])
        ratio = rng.uniform(100, 300)
        noisy_dn = K * rng.poisson(clean * (RANGE_DN / K / ratio)) + rng.normal(0, READ_DN, clean.shape)
        return {"noisy": (noisy_dn * (ratio / RANGE_DN)).astype(np.float32), "clean": clean}
