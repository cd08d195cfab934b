"""Responsivity and linearity error of a sensor (EMVA 1288 R4.0 Linear: sensitivity and linearity)."""

from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError

LOWEST_SHARE, HIGHEST_SHARE = 0.05, 0.95  # of the saturation signal: range in which EMVA 1288 R4.0 evaluates linearity


@dataclass(frozen=True)
class Linearity:
    """Relative deviations of the signal from a fitted line.

    photons: (n,) [photons per photosite]. deviation: (n,) relative. offset_dn, slope_dn: of the line [DN, DN/photon].
    """

    photons: np.ndarray
    deviation: np.ndarray
    offset_dn: float
    slope_dn: float

    @property
    def least(self) -> float:
        """LE_min, relative."""
        return float(self.deviation.min())

    @property
    def greatest(self) -> float:
        """LE_max, relative."""
        return float(self.deviation.max())


def responsivity(photons: np.ndarray, signal_dn: np.ndarray) -> float:
    """Return R = K eta [DN/photon]: least-squares slope, through 0, of the signal above dark over the photons.

    photons, signal_dn: (n,), up to 70 % of saturation.
    """
    return float(photons @ signal_dn / (photons @ photons))


def linearity(photons: np.ndarray, signal_dn: np.ndarray, saturation_dn: float) -> Linearity:
    """Return the deviation of the signal above dark from a fitted line, between 5 % and 95 % of saturation.

    The line a + b photons minimises the sum of squared relative deviations, so that dark and bright steps have equal weight.
    Raises PhotositeError with fewer than three steps in that range.
    """
    inside = (signal_dn >= LOWEST_SHARE * saturation_dn) & (signal_dn <= HIGHEST_SHARE * saturation_dn)
    if np.count_nonzero(inside) < 3:
        raise PhotositeError("linearity: fewer than three steps between 5 % and 95 % of saturation; take more steps")
    photons, signal_dn = photons[inside], signal_dn[inside]
    columns = np.stack([np.ones_like(photons), photons], axis=1) / signal_dn[:, np.newaxis]
    (offset, slope), *_ = np.linalg.lstsq(columns, np.ones_like(photons), rcond=None)
    line = offset + slope * photons
    return Linearity(photons, (signal_dn - line) / line, float(offset), float(slope))
