"""Dead pixels: some photosites do not respond to light."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage


@dataclass(frozen=True)
class DeadPixels(Stage):
    """electrons = 0 in a share of the photosites, drawn once for the body. Their dark signal and read noise stay.

    share: probability of a photosite to be dead, 0 to 1.
    """

    stem: ClassVar[str] = "dead_pixels"
    neutral: ClassVar[dict[str, float]] = {"share": 0.0}
    is_defect: ClassVar[bool] = True
    share: float

    def __post_init__(self) -> None:
        require(0 <= self.share <= 1, "dead_pixels.share", self.share, "give a share from 0 to 1, such as 1e-5")

    def combined(self, side: int, codes: float) -> "DeadPixels | None":
        """Return None: one dead photosite of several is a slightly lower response, below what PRNU makes."""
        return self if side == 1 else None

    def moments(self, signal: Moments) -> Moments:
        """Return those of a photosite that is not dead."""
        return signal
