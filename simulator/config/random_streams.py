"""Random numbers that are functions of a seed, a number and what they are for; nothing else."""

import zlib
from dataclasses import dataclass

import numpy as np

LARGEST_SEED = 2**64 - 1
_MULTIPLIERS, _WEYL = (0xD2E7470EE14C6C93, 0xCA5A826395121157), (0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B)


@dataclass(frozen=True)
class RandomStream:
    """Random numbers of one sample or point (Philox4x64-10, Salmon et al. 2011: key = seed, counter = index, attempt, purpose).

    Each purpose has its own counter range, so drawing more numbers for one purpose changes no other.

    seed: of the data set or axis, 0 to 2^64 - 1. index: number of the sample or point.
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
        """Return uniform numbers between 0 and 1, both excluded: from the words that NumPy's generator begins with."""
        place, words = zlib.crc32(purpose.encode()), list[int]()
        for block in range(1, -(-count // 4) + 1):  # NumPy counts before it draws
            words += philox_4x64((block, place, self.attempt, int(self.index)), self.seed)
        return [((word >> 11) + 0.5) * 2.0**-53 for word in words[:count]]

    def uniform(self, purpose: str) -> float:
        """Return the first number of `uniforms`."""
        return self.uniforms(purpose, 1)[0]

    def integer(self, purpose: str, count: int) -> int:
        """Return a uniform integer from 0 to count - 1."""
        return min(int(self.uniform(purpose) * count), count - 1)


def philox_4x64(counter: tuple[int, int, int, int], key: int) -> tuple[int, int, int, int]:
    """Return four words of 64 bits: Philox4x64-10 (Salmon et al. 2011) with the key (key, 0).

    Python's whole numbers take half the time of a NumPy generator that is made for a few words.
    """
    a, b, c, d = counter
    other = 0
    for _ in range(10):
        low, high = _MULTIPLIERS[0] * a, _MULTIPLIERS[1] * c
        a, b, c, d = (high >> 64) ^ b ^ key, high & LARGEST_SEED, (low >> 64) ^ d ^ other, low & LARGEST_SEED
        key, other = (key + _WEYL[0]) & LARGEST_SEED, (other + _WEYL[1]) & LARGEST_SEED
    return a, b, c, d
