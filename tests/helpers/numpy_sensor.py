"""A sensor in float64 NumPy, the truth for measurements: every number of it is known because it is put in here."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class NumpySensor:
    """codes = rint(K (min(Poisson(n (1 + PRNU)) , full well) + DSNU + row + read) + black), clipped.

    All in electrons except black_dn. dsnu_e: (row, column, pixel) parts; prnu: relative.
    """

    gain: float = 0.25
    read_noise_e: float = 5.0
    black_dn: float = 64.0
    bits: int = 12
    row_noise_e: float = 0.0
    dsnu_e: tuple[float, float, float] = (0.0, 0.0, 0.0)
    prnu: tuple[float, float, float] = (0.0, 0.0, 0.0)
    full_well_e: float = np.inf
    shape: tuple[int, int] = (120, 160)
    seed: int = 1
    random: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.random = np.random.default_rng(self.seed)
        self.dark_pattern_e = self._pattern(self.dsnu_e)
        self.light_pattern = 1.0 + self._pattern(self.prnu)

    def _pattern(self, parts: tuple[float, float, float]) -> np.ndarray:
        rows, columns = self.shape
        sizes = ((rows, 1), (1, columns), self.shape)
        row, column, pixel = (self.random.normal(0.0, sd, size) for sd, size in zip(parts, sizes, strict=True))
        return row + column + pixel

    def frame(self, mean_e: float) -> np.ndarray:
        electrons = np.minimum(self.random.poisson(mean_e * self.light_pattern), self.full_well_e) + self.dark_pattern_e
        electrons = electrons + self.random.normal(0.0, self.row_noise_e, (self.shape[0], 1))
        electrons = electrons + self.random.normal(0.0, self.read_noise_e, self.shape)
        return np.clip(np.rint(self.gain * electrons + self.black_dn), 0, 2**self.bits - 1).astype(np.uint16)

    def frames(self, mean_e: float, count: int) -> list[np.ndarray]:
        return [self.frame(mean_e) for _ in range(count)]
