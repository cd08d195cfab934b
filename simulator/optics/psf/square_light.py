"""Squares and tents of light behind a point spread function, a low-pass filter and the aperture of photosites, along one axis.

Nothing is cut at half a cycle per photosite, so that no light is negative.
"""

import math
from functools import lru_cache

import numpy as np

from simulator.optics.psf.pixel_aperture import Sampling


def line_weights(
    sampling: Sampling,
    pitch_um: float,
    away_px: np.ndarray,
    width_px: float,
    size: tuple[int, int],
    *,
    is_tent: bool = False,
    of_samples: bool = False,
) -> np.ndarray:
    """Weights of the cells of a kernel in photosites so far from the middle of a pixel of light 1, (photosites, cells) float64.

    The light of a photosite is down @ cells @ across.T. size: cells across, and per photosite, both odd, which are integrals of
    a function that is band-limited to them; of_samples: they are samples of it. width_px: of the pixel [photosites].
    is_tent: whether its light is bilinear, and twice as wide at its foot.
    """
    period = 2 * math.ceil(np.abs(away_px).max() + 0.5 * size[0] / size[1] + 1.0)
    cycles, spectrum = _spectrum(sampling, *size, pitch_um, width_px, is_tent, of_samples, period)
    return np.ascontiguousarray(np.real(np.exp(2j * math.pi * np.outer(away_px, cycles)) @ spectrum))


def square_phases(sampling: Sampling, pitch_um: float, cells: np.ndarray, per_photosite: int, over: int) -> np.ndarray:
    """Kernels from light samples that are even squares to photosites, as of `Sampling.phases`, without negative values.

    cells: light of a point in each of odd x odd cells, per_photosite (odd) to a photosite and axis, which are integrals of a
    function that is band-limited to them.
    """
    reach_px = len(cells) // per_photosite // 2 + sampling.margin_px(pitch_um)
    lines = _square_lines(sampling, pitch_um, reach_px, (len(cells), per_photosite), over)
    halves = [line @ cells for line in lines]
    found = np.maximum(np.array([half @ line.T for half in halves for line in lines]), 0.0)
    return found * (cells.sum(dtype=np.float64) / found.sum())


def square_matrix(sampling: Sampling, size_px: int, per_photosite: int, pitch_um: float) -> np.ndarray:
    """As `Sampling.photosite_matrix`, of light samples that are the even squares of a scene, one per photosite."""
    reach_px = size_px // 2 + sampling.margin_px(pitch_um)
    away_px, size = np.arange(-reach_px, reach_px + 1.0), (per_photosite * size_px, per_photosite)
    return line_weights(sampling, pitch_um, away_px, 1.0, size, of_samples=True)


@lru_cache(maxsize=8)
def _square_lines(sampling: Sampling, pitch_um: float, reach_px: int, size: tuple[int, int], over: int) -> list[np.ndarray]:
    """Weights of cells along an axis, by phase of an even square. size: as of `line_weights`."""
    photosites = np.arange(-reach_px, reach_px + 1)
    away = (photosites + (over - 1 - 2 * phase) / (2 * over) for phase in range(over))
    return [line_weights(sampling, pitch_um, one, 1.0 / over, size) for one in away]


def shared_length(sampling: Sampling, pitch_um: float, away_px: np.ndarray, width_px: float, *, is_tent: bool) -> np.ndarray:
    """Mean light of one axis of photosites so far from the middle of a pixel of light 1, same shape as away_px, exact.

    width_px: of the pixel [photosites]; a tent is twice as wide at its foot.
    """

    def until(x: np.ndarray) -> np.ndarray:
        place = x / width_px
        if not is_tent:
            return width_px * np.clip(place + 0.5, 0.0, 1.0)
        place = np.clip(place, -1.0, 1.0)
        return width_px * (0.5 + place - 0.5 * place * np.abs(place))

    side, apart = math.sqrt(sampling.fill_factor), 0.5 * sampling.low_pass_um / pitch_um
    spots = (until(away_px + spot + 0.5 * side) - until(away_px + spot - 0.5 * side) for spot in (-apart, apart))
    return np.asarray(0.5 * sum(spots) / side)


@lru_cache(maxsize=8)
def _spectrum(
    sampling: Sampling,
    count: int,
    per_photosite: int,
    pitch_um: float,
    width_px: float,
    is_tent: bool,
    of_samples: bool,
    period: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [cycles per photosite], and the spectrum at each of the light of cells, (frequencies, cells).

    The light repeats after `period` photosites, an even number.
    """
    cycles = np.arange(-per_photosite * period // 2, per_photosite * period // 2 + 1) / period
    transfer = sampling.transfer(cycles / pitch_um, pitch_um) * np.sinc(cycles * width_px) ** (1 + is_tent)
    if not of_samples:
        transfer /= np.sinc(cycles / per_photosite)
    transfer[[0, -1]] *= 0.5
    into = np.exp(-2j * math.pi * np.outer(cycles, (np.arange(count) - count // 2) / per_photosite))
    return cycles, np.ascontiguousarray((width_px / period * transfer)[:, None] * into)
