"""Seeds of the counter-based random numbers."""

from dataclasses import dataclass
from numbers import Integral

from simulator.errors import require

LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class Seeds:
    """Seeds of the counter-based random numbers, 0 to 2^32 - 1.

    body: of the fixed patterns of one camera body.
    frame: of the temporal noise, which is new in each frame.
    """

    body: int = 0
    frame: int = 0

    def __post_init__(self) -> None:
        for key, seed in (("body", self.body), ("frame", self.frame)):
            good = isinstance(seed, Integral) and 0 <= seed <= LARGEST_SEED
            require(good, f"seeds.{key}", seed, f"give a whole number from 0 to {LARGEST_SEED}")
