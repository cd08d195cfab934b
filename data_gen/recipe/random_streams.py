"""The random numbers of a data set: functions of its seed, a sample's number and what they are for; nothing else."""

import zlib
from dataclasses import dataclass

import numpy as np

LARGEST_SEED = 2**64 - 1


@dataclass(frozen=True)
class Chance:
    """Random numbers of one sample (Philox4x64-10, Salmon et al. 2011: key = seed, counter = number, attempt, purpose).

    Each purpose has numbers of its own, so that drawing more for one changes no other.

    seed: of the data set, 0 to 2^64 - 1. index: number of the sample.
    attempt: 0, or how many pictures drawn before for this sample could not be used.
    """

    seed: int
    index: int
    attempt: int = 0

    def generator(self, purpose: str) -> np.random.Generator:
        """Generator of its own for a purpose."""
        counter = [0, zlib.crc32(purpose.encode()), self.attempt, self.index]
        return np.random.Generator(np.random.Philox(key=self.seed, counter=counter))

    def shares(self, purpose: str, count: int) -> list[float]:
        """Numbers evenly distributed between 0 and 1, both excluded."""
        counter = [0, zlib.crc32(purpose.encode()), self.attempt, self.index]
        words = np.random.Philox(key=self.seed, counter=counter).random_raw(count)
        return [(int(word >> np.uint64(11)) + 0.5) * 2.0**-53 for word in words]

    def share(self, purpose: str) -> float:
        """Return the first of `shares`."""
        return self.shares(purpose, 1)[0]

    def whole(self, purpose: str, count: int) -> int:
        """Whole number from 0 to count - 1, all equally likely."""
        return min(int(self.share(purpose) * count), count - 1)
