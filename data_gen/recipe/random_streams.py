"""The random numbers of a data set: functions of its seed, a sample's number and what they are for; nothing else."""

import zlib
from dataclasses import dataclass

import numpy as np

LARGEST_SEED = 2**64 - 1


@dataclass(frozen=True)
class RandomStream:
    """Random numbers of one sample (Philox4x64-10, Salmon et al. 2011: key = seed, counter = index, attempt, purpose).

    Each purpose has its own counter range, so drawing more numbers for one purpose changes no other.

    seed: of the data set, 0 to 2^64 - 1. index: number of the sample.
    attempt: 0, or how many pictures drawn before for this sample could not be used.
    """

    seed: int
    index: int
    attempt: int = 0

    def generator(self, purpose: str) -> np.random.Generator:
        """Return NumPy's generator for a purpose."""
        counter = [0, zlib.crc32(purpose.encode()), self.attempt, self.index]
        return np.random.Generator(np.random.Philox(key=self.seed, counter=counter))

    def uniforms(self, purpose: str, count: int) -> list[float]:
        """Return uniform numbers between 0 and 1, both excluded."""
        counter = [0, zlib.crc32(purpose.encode()), self.attempt, self.index]
        words = np.random.Philox(key=self.seed, counter=counter).random_raw(count)
        return [(int(word >> np.uint64(11)) + 0.5) * 2.0**-53 for word in words]

    def uniform(self, purpose: str) -> float:
        """Return the first number of `uniforms`."""
        return self.uniforms(purpose, 1)[0]

    def integer(self, purpose: str, count: int) -> int:
        """Return a uniform integer from 0 to count - 1."""
        return min(int(self.uniform(purpose) * count), count - 1)
