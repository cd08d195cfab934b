"""Crosstalk: what belongs to one photosite and shows in its neighbours."""

from dataclasses import dataclass

from simulator.errors import require
from simulator.sensor.stages.stage import Moments


@dataclass(frozen=True)
class Crosstalk:
    """Shares that go to each neighbour; both passes are absent when zero.

    Optical crosstalk (and diffusion of electrons before they are collected) mixes mean light, so the counts of neighbours
    stay independent. Electrical crosstalk (interpixel capacitance, Moore et al. 2006) mixes what has been counted, so shot
    noise falls a little and is correlated.

    optical: share of the light that falls into each of the four neighbours beside, 0 to 0.2.
    optical_corner: likewise into each of the four at the corners.
    electrical: share of the collected charge that each of the four neighbours beside sees, 0 to 0.2.
    electrical_corner: likewise at the corners.
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
        """Moments behind electrical crosstalk between equally lit photosites: var * the sum of the squared shares."""
        side, corner = self.electrical_shares
        left = self.kept(self.electrical_shares) ** 2 + 4.0 * side**2 + 4.0 * corner**2
        return Moments(signal.mean, left * signal.variance, left * signal.fixed_variance)

    @property
    def optical_shares(self) -> tuple[float, float]:
        """Shares beside and at the corners."""
        return self.optical, self.optical_corner

    @property
    def electrical_shares(self) -> tuple[float, float]:
        """Shares beside and at the corners."""
        return self.electrical, self.electrical_corner

    @staticmethod
    def kept(shares: tuple[float, float]) -> float:
        """Share that stays."""
        return 1.0 - 4.0 * sum(shares)
