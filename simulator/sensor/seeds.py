"""Seeds of the counter-based random numbers."""

from dataclasses import dataclass
from numbers import Integral

from simulator.errors import require

LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class Seeds:
    """Seeds of the counter-based random numbers, 0 to 2^32 - 1.

    body: what belongs to one camera body (fixed patterns).
    frame: what is new in each frame (temporal noise).
    """

    body: int = 0
    frame: int = 0

    def __post_init__(self):
        for key, seed in (("body", self.body), ("frame", self.frame)):
            good = isinstance(seed, Integral) and 0 <= seed <= LARGEST_SEED
            require(good, f"seeds.{key}", seed, f"give a whole number from 0 to {LARGEST_SEED}")
