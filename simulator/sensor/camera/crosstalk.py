"""Crosstalk: a share of the signal of each photosite appears in its neighbours."""

from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.sensor.stages.stage import Moments


@dataclass(frozen=True)
class Crosstalk:
    """Shares that go to each neighbour; a pass whose shares are 0 is skipped.

    Optical crosstalk (and diffusion of electrons before they are collected) mixes mean light, so the counts of neighbours
    stay independent. Electrical crosstalk (interpixel capacitance, Moore et al. 2006) mixes the collected charge, so that shot
    noise decreases a little and is correlated.

    optical: share of the light that goes to each of the four direct neighbours, 0 to 0.2.
    optical_corner: likewise to each of the four diagonal neighbours.
    electrical: share of the collected charge that appears in each of the four direct neighbours, 0 to 0.2.
    electrical_corner: likewise in each of the four diagonal neighbours.
    """

    optical: float = 0.0
    optical_corner: float = 0.0
    electrical: float = 0.0
    electrical_corner: float = 0.0

    def __post_init__(self) -> None:
        for key in ("optical", "optical_corner", "electrical", "electrical_corner"):
            share = getattr(self, key)
            require(0 <= share <= 0.2, f"camera.crosstalk.{key}", share, "give a share from 0 to 0.2, such as 0.01")
        for key, kept in (("optical", self.kept(self.optical_shares)), ("electrical", self.kept(self.electrical_shares))):
            require(kept >= 0, f"camera.crosstalk.{key}", f"{kept:g} kept", "the eight shares may not add up to more than 1")

    def of_charge(self, signal: Moments) -> Moments:
        """Return the moments after electrical crosstalk between equally illuminated photosites: var * sum of squared shares."""
        side, corner = self.electrical_shares
        left = self.kept(self.electrical_shares) ** 2 + 4.0 * side**2 + 4.0 * corner**2
        return signal.widened(left, signal.mean)

    def correlation(self, factor: int, step: int) -> float:
        """Return the variance of the sum of binned photosites after electrical crosstalk, over that of independent ones.

        factor: photosites on either side that are summed, `step` photosites apart. Crosstalk moves charge between them, so that
        their sum keeps more of its noise than each of them.
        """
        one, summed = self._summed_shares(1, 1), self._summed_shares(factor, step)
        return float((summed**2).sum() / (factor**2 * (one**2).sum()))

    def shares_at_edges(self, factor: int, step: int) -> np.ndarray:
        """Return the shares of the charge around summed photosites that go into the sum, float32.

        Shape (16, taps, taps), taps = step * (factor - 1) + 3: without an edge, and where the frame ends above (+ 1), below
        (+ 2), to the left (+ 4) or to the right (+ 8) of them; there the outermost photosites stand in for those beyond, so
        that their shares add. factor, step: as of `correlation`.
        """
        tables = []
        for edges in range(16):
            shares = self._summed_shares(factor, step)
            for ends, view in (
                (edges & 1, shares),
                (edges & 2, shares[::-1]),
                (edges & 4, shares.T),
                (edges & 8, shares.T[::-1]),
            ):
                if ends:
                    view[1] += view[0]
                    view[0] = 0.0
            tables.append(shares)
        return np.array(tables, np.float32)

    def _summed_shares(self, factor: int, step: int) -> np.ndarray:
        """Return the shares of the charge around summed photosites that go into the sum, (taps, taps) float64."""
        side, corner = self.electrical_shares
        shares = np.array([[corner, side, corner], [side, self.kept(self.electrical_shares), side], [corner, side, corner]])
        reach = step * (factor - 1) + 1
        summed = np.zeros((reach + 2, reach + 2))
        for row in range(0, reach, step):
            for column in range(0, reach, step):
                summed[row : row + 3, column : column + 3] += shares
        return summed

    @property
    def optical_shares(self) -> tuple[float, float]:
        """Optical shares of a direct and of a diagonal neighbour."""
        return self.optical, self.optical_corner

    @property
    def electrical_shares(self) -> tuple[float, float]:
        """Electrical shares of a direct and of a diagonal neighbour."""
        return self.electrical, self.electrical_corner

    @staticmethod
    def kept(shares: tuple[float, float]) -> float:
        """Return the share that remains in the photosite. shares: to each direct and to each diagonal neighbour."""
        return 1.0 - 4.0 * sum(shares)
