"""A camera body in float64 NumPy that writes raw files: the truth that a calibration has to find."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy import stats

from helpers.raw_frame import random_frame
from simulator.raw.dng.writer import write_dng


@dataclass(frozen=True)
class NumpyBody:
    """Noise of every kind that `photosite calibrate` measures; sigma_pre and dsnu [e-], the other sigmas [DN].

    gain: K of ISO 100 [DN/e-]; it grows with ISO. switch: first ISO at which sigma_pre is that of high conversion gain.
    """

    gain: float = 0.25
    sigma_pre: float = 4.0
    sigma_pre_high: float = 1.2
    switch: int = 10**9
    sigma_post: float = 1.3
    lam: float = 0.14
    row: float = 0.5  # at ISO 100, growing with the root of the ISO
    bias: tuple = (0.8, -0.3, 0.1, -0.6)  # R, Gr, Gb, B
    black: float = 512.25
    black_in_file: int = 512
    white: int = 15300
    dsnu: float = 1.5
    column: float = 0.35
    prnu: float = 0.008
    dark_current: float = 3.0
    shape: tuple[int, int] = (220, 260)
    seed: int = 1
    cfa: str = "RGGB"
    colors: tuple = (0.6, 1.0, 1.0, 0.7)
    pattern: dict = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        generator = np.random.default_rng([self.seed, 99])
        dsnu = generator.normal(0.0, self.dsnu, self.shape)
        prnu = 1.0 + generator.normal(0.0, self.prnu, self.shape)
        self.pattern.update(dsnu=dsnu, prnu=prnu, column=generator.normal(0.0, self.column, self.shape[1]))

    def k(self, iso: int) -> float:
        return self.gain * iso / 100.0

    def row_noise(self, iso: int) -> float:
        return self.row * np.sqrt(iso / 100.0)

    def read_noise(self, iso: int) -> float:
        before = self.sigma_pre if iso < self.switch else self.sigma_pre_high
        return float(np.hypot(self.k(iso) * before, self.sigma_post))

    def codes(self, iso: int, level: float, time_s: float, frame: int) -> np.ndarray:
        """One frame; level: mean signal of green at the centre [DN above black]."""
        generator = np.random.default_rng([self.seed, iso, frame, int(1000 * level), int(1e6 * time_s)])
        height, width = self.shape
        y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
        light = level / self.k(iso) / (1.0 + 0.2 * (x**2 + y**2)) ** 2
        place = 2 * (np.arange(height)[:, None] % 2) + np.arange(width) % 2  # RGGB
        electrons = generator.poisson(light * np.array(self.colors)[place] * self.pattern["prnu"])
        electrons = electrons + generator.poisson(self.dark_current * time_s, self.shape) + self.pattern["dsnu"]
        sigma = self.read_noise(iso)
        noise = stats.tukeylambda.ppf(generator.random(self.shape), self.lam) * sigma / stats.tukeylambda.std(self.lam)
        rows = generator.normal(0.0, self.row_noise(iso), (height, 1))
        signal = self.k(iso) * electrons + noise + rows + self.pattern["column"] + np.array(self.bias)[place] + self.black
        return np.clip(np.rint(signal), 0, self.white).astype(np.uint16)

    def write(self, path: Path, iso: int, level: float = 0.0, time_s: float = 0.001, frame: int = 0) -> Path:
        """Write a frame as DNG."""
        path.parent.mkdir(parents=True, exist_ok=True)
        raw = random_frame(
            *self.shape, self.cfa, black_level_dn=self.black_in_file, white_level_dn=16383, iso=iso, exposure_time_s=time_s
        )
        write_dng(type(raw)(**{**vars(raw), "dn": self.codes(iso, level, time_s, frame)}), path)
        return path

    def shoot(self, folder: Path, isos: list[int], darks: int = 8, levels: tuple = (800.0, 3000.0, 9000.0)) -> Path:
        """Write what docs/calibration.md asks for."""
        for iso in isos:
            for frame in range(darks):
                self.write(folder / "dark" / f"iso{iso}_{frame}.dng", iso, frame=frame)
            for index, level in enumerate(levels):
                for frame in range(2):
                    name = f"iso{iso}_{index}_{frame}.dng"
                    self.write(folder / "flat" / name, iso, level, time_s=0.01 * (index + 1), frame=frame)
        return folder
