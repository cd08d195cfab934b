"""What a time budget chose for a shot."""

from dataclasses import dataclass, replace

from simulator.pipeline.shot import Shot


@dataclass(frozen=True)
class TimeFit:
    """The tolerance that a time budget allows.

    budget_s: as stated. tolerance: chosen [standard deviations of the noise]. predicted_s: time of all passes at it.
    """

    budget_s: float
    tolerance: float
    predicted_s: float

    @property
    def is_kept(self) -> bool:
        """Whether the predicted time keeps the budget; False: even the least accurate plan takes longer."""
        return self.predicted_s <= self.budget_s

    def warnings(self) -> list[str]:
        """Return a sentence for a budget that is not kept; [] where it is."""
        if self.is_kept:
            return []
        return [
            f"time_budget = {self.budget_s:g} s is not kept: the least exact plan, tolerance {self.tolerance:g}, takes about "
            f"{self.predicted_s:.2g} s; read a part of the sensor with camera.window, or give more time"
        ]

    def settle(self, shot: Shot) -> Shot:
        """Return the shot with the tolerance that was chosen, which takes no time budget to repeat."""
        return replace(shot, tolerance=self.tolerance, time_budget_s=None)
