"""Full well: a photosite holds a limited number of electrons (EMVA 1288 R4.0: saturation capacity)."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from simulator.errors import require
from simulator.sensor.stages.stage import Limits, Moments, Photodiode, Stage
from simulator.units import Electrons


@dataclass(frozen=True)
class FullWell(Stage):
    """electrons = min(electrons, capacity).

    capacity_e: largest number of electrons that a photosite holds [e-], > 0.
    """

    stem: ClassVar[str] = "full_well"
    changes_mean: ClassVar[bool] = True
    capacity_e: Electrons

    def __post_init__(self) -> None:
        require(self.capacity_e > 0, "full_well.capacity", f"{self.capacity_e} e-", "a well must hold at least one electron")

    def combined(self, side: int, codes: float) -> "FullWell":
        """Return the well of the sum of side x side photosites."""
        return FullWell(side**2 * self.capacity_e)

    def of_photodiode(self, diode: Photodiode) -> Self:
        """Return the diode's own well."""
        return replace(self, capacity_e=diode.full_well * self.capacity_e)

    def moments(self, signal: Moments) -> Moments:
        """Unchanged below the capacity; constant at it."""
        return signal if signal.mean < self.capacity_e else Moments(self.capacity_e, 0.0)

    def unclipped_moments(self, signal: Moments) -> Moments:
        """Unchanged."""
        return signal

    def clip_limits(self, before: Limits) -> Limits:
        """At most the capacity [e-]."""
        return -math.inf, self.capacity_e
