"""Nonlinearity of ADC and amplifiers (EMVA 1288 R4.0: linearity error; integral nonlinearity of an ADC)."""

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from simulator.errors import require
from simulator.sensor.stages.stage import FromShot, Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class Nonlinearity(Stage):
    """signal += error(signal), interpolated linearly between evenly spaced nodes from 0 to full scale, constant beyond.

    errors_dn: errors [DN] at 0, ..., full scale; 2 to 4096 of them. A measured curve or look-up table minus the identity.
    full_scale_dn: signal of the last node [DN]: white level minus black level of the camera.
    """

    stem: ClassVar[str] = "nonlinearity"
    changes_mean: ClassVar[bool] = True
    is_linear: ClassVar[bool] = False
    errors_dn: tuple[DigitalNumbers, ...]
    full_scale_dn: Annotated[DigitalNumbers, FromShot("full_scale_dn")] = 65535.0

    def __post_init__(self) -> None:
        count, most_dn = len(self.errors_dn), max(map(abs, self.errors_dn), default=0.0)
        require(2 <= count <= 4096, "nonlinearity.errors", f"{count} values", "give 2 to 4096 values, from 0 to full scale")
        require(most_dn < 65536, "nonlinearity.errors", f"{most_dn:g} DN", "an error is smaller than the range of codes")

    def kernel_values(self) -> dict[str, float | tuple[float, ...]]:
        """Return the errors, and nodes per DN."""
        return {"errors_dn": self.errors_dn, "nodes_per_dn": (len(self.errors_dn) - 1) / self.full_scale_dn}

    def combined(self, side: int, codes: float) -> "Nonlinearity":
        """Return the same curve in other codes; that of a mean of equal signals is that of each."""
        return replace(self, errors_dn=tuple(codes * error_dn for error_dn in self.errors_dn))

    def moments(self, signal: Moments) -> Moments:
        """Give mean + error there, var * slope^2 there."""
        nodes = np.linspace(0.0, self.full_scale_dn, len(self.errors_dn))
        error_dn = np.interp(signal.mean, nodes, self.errors_dn)
        inside = (np.asarray(signal.mean) >= 0.0) & (np.asarray(signal.mean) < self.full_scale_dn)
        step = np.where(inside, np.searchsorted(nodes, signal.mean, side="right") - 1, 0)
        slope = 1.0 + np.where(inside, (np.diff(self.errors_dn) / np.diff(nodes))[step], 0.0)
        return signal.widened(slope**2, signal.mean + error_dn)
