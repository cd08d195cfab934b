"""Modulation transfer of a round pupil with a wavefront error, as the autocorrelation of its pupil function."""

import functools
import math
from collections.abc import Callable

import numpy as np

NODES = 24  # of Gauss and Legendre on either axis of the overlap of a wavefront without error
NODES_PER_WAVE = 4  # more of them for each wave by which the error differs; 3.14 are the least
COARSE = 17  # points on either axis that find by how many waves


def wavefront_transfer(
    wavefront_error_um: Callable[[np.ndarray, np.ndarray], np.ndarray], wavelength_um: float, shifts: np.ndarray
) -> np.ndarray:
    """Return the modulation transfer of a pupil for modulation along x, same shape as the shifts.

    |1 / pi integral of exp(2 pi i (W(x + s / 2, y) - W(x - s / 2, y)) / lambda)| over the overlap of two unit disks s apart
    (Goodman, Introduction to Fourier Optics, 6.3 and 6.4). wavefront_error_um: W at points of the unit disk [um].
    shifts: s = 2 frequency wavelength f-number [pupil radii], >= 0; from 2 on the transfer is 0.
    """
    return np.array([_transfer(wavefront_error_um, wavelength_um, float(shift)) for shift in shifts])


def _transfer(wavefront_error_um: Callable[[np.ndarray, np.ndarray], np.ndarray], wavelength_um: float, shift: float) -> float:
    if shift >= 2.0:
        return 0.0

    def waves_at(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (wavefront_error_um(x + 0.5 * shift, y) - wavefront_error_um(x - 0.5 * shift, y)) / wavelength_um

    x, y, _ = _overlap_nodes(COARSE, shift)
    x, y, weights = _overlap_nodes(NODES + math.ceil(NODES_PER_WAVE * float(np.ptp(waves_at(x, y)))), shift)
    return abs(complex(np.sum(weights * np.exp(2j * math.pi * waves_at(x, y))))) / math.pi


def _overlap_nodes(count: int, shift: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x, y and weight of nodes in the overlap of two unit disks, (count, count) each.

    y is the sine of a variable of even nodes, in which the width of the overlap has no root at its ends.
    """
    nodes, weights = _legendre(count)
    angle = 0.5 * math.pi * nodes
    top = math.sqrt(1.0 - 0.25 * shift**2)
    y = top * np.sin(angle)
    width = np.sqrt(1.0 - y**2) - 0.5 * shift
    down = weights * 0.5 * math.pi * top * np.cos(angle)
    return width[:, None] * nodes, np.broadcast_to(y[:, None], (count, count)), (down * width)[:, None] * weights


@functools.lru_cache(maxsize=64)
def _legendre(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(count)
