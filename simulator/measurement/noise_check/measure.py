"""Measurement of K, read noise, row noise and full scale of one ISO from raw files alone."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simulator.measurement.noise_check.frames import NoiseFiles, Pair
from simulator.measurement.statistics.interval import Interval
from simulator.measurement.statistics.photon_transfer import (
    DarkNoise,
    dark_noise,
    dynamic_range,
    gain,
    gain_without_dark,
    points_below_saturation,
    read_noise_e,
    transfer_point,
)
from simulator.measurement.statistics.temporal_noise import PairNoise, pair_noise
from simulator.raw.raw_reader import read_raw_file


@dataclass(frozen=True)
class IsoNoise:
    """Numbers measured at one ISO.

    gain: K [DN/e-]. dark: of single photosites, without row noise. dark_is_clipped: over 1 in 1000 codes of dark frames is 0.
    row_noise_dn: standard deviation of the offsets of rows. saturation_dn: mean code of a saturated frame less the dark one.
    """

    iso: int
    gain: Interval
    dark: DarkNoise
    dark_is_clipped: bool
    row_noise_dn: float
    saturation_dn: float

    @property
    def read_noise_dn(self) -> float:
        """Standard deviation without the 1/12 DN^2 of rounding [DN]."""
        return read_noise_e(self.dark, 1.0)

    @property
    def read_noise_e(self) -> float:
        """Read noise in electrons [e-]."""
        return read_noise_e(self.dark, self.gain.value)

    @property
    def full_scale_e(self) -> float:
        """Electrons at saturation [e-]."""
        return self.saturation_dn / self.gain.value

    @property
    def dynamic_range_stops(self) -> float:
        """Full scale over the signal at which the SNR is 1 (EMVA 1288), in powers of 2."""
        return math.log2(dynamic_range(self.full_scale_e, self.dark, self.gain.value))


def measure_iso_noise(files: NoiseFiles) -> IsoNoise:
    """Measure one ISO from its DNG files; all four colour planes share one gain. Raises PhotositeError."""
    dark_pairs = [_plane_noise(pair) for pair in files.dark]
    saturated = read_raw_file(files.saturated)
    dark = dark_noise([noise for planes in dark_pairs for noise in planes.values()], row_noise=False)
    clipped = float(np.mean(read_raw_file(files.dark[0][0]).mosaic == 0)) > 1e-3
    names = list(saturated.planes())
    black_dn = dict.fromkeys(names, float(saturated.black_level_dn.mean()))
    if not clipped:
        black_dn = {name: float(np.mean([planes[name].mean_dn for planes in dark_pairs])) for name in names}
    rise_dn = float(np.mean([plane.mean() - black_dn[name] for name, plane in saturated.planes().items()]))
    points = [
        transfer_point(noise, black_dn[name], row_noise=False)
        for pair in files.flat
        for name, noise in _plane_noise(pair).items()
    ]
    fitted = points_below_saturation(points, rise_dn)
    row_variance = float(np.mean([noise.row_variance_dn2 for planes in dark_pairs for noise in planes.values()]))
    return IsoNoise(
        iso=files.iso,
        gain=gain_without_dark(fitted) if clipped else gain(fitted, dark),
        dark=dark,
        dark_is_clipped=clipped,
        row_noise_dn=math.sqrt(max(row_variance, 0.0)),
        saturation_dn=rise_dn,
    )


def _plane_noise(pair: Pair) -> dict[str, PairNoise]:
    first, second = (read_raw_file(path).planes() for path in pair)
    return {name: pair_noise(first[name], second[name]) for name in first}


def log_slope(isos: Sequence[float], gains: Sequence[float]) -> float:
    """Slope of ln K on ln ISO; 1 where K is proportional to ISO."""
    return float(np.polyfit(np.log(isos), np.log(gains), 1)[0])


def noise_steps(read_noise: dict[int, float]) -> list[tuple[int, int]]:
    """Find neighbouring ISOs between which the read noise in electrons drops by a switch of conversion gain.

    read_noise: by ISO [e-]. With one noise source before and one after the gain, it falls like 1 / ISO at most.
    """
    found = []
    for low, high in pairwise(sorted(read_noise)):
        steepest = 1.2 * high / low  # measured tables scatter
        if read_noise[high] > 0 and read_noise[low] / read_noise[high] > steepest:
            found.append((low, high))
    return found
