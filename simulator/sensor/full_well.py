"""Full well: a photosite holds only so many electrons (EMVA 1288 R4.0: saturation capacity)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.stage import Moments, Stage
from simulator.units import Electrons


@dataclass(frozen=True)
class FullWell(Stage):
    """electrons = min(electrons, capacity).

    capacity_e: most electrons a photosite holds [e-], > 0.
    """

    stem: ClassVar[str] = "full_well"
    capacity_e: Electrons

    def __post_init__(self):
        require(self.capacity_e > 0, "full_well.capacity", f"{self.capacity_e} e-", "a well must hold at least one electron")

    def moments(self, signal: Moments) -> Moments:
        """Unchanged below the capacity; constant at it."""
        return signal if signal.mean < self.capacity_e else Moments(self.capacity_e, 0.0)
