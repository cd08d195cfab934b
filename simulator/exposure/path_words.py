"""Random numbers of a path: functions of its seed alone, the same on every machine and with every NumPy."""

import numpy as np

LARGEST_SEED = 2**64 - 1


def uniforms(seed: int, count: int) -> np.ndarray:
    """Return uniform numbers between 0 and 1, both excluded, (count,) float64, from the words of Philox4x64-10 of a seed."""
    words = np.random.Philox(key=seed).random_raw(count)
    return ((words >> np.uint64(11)) + 0.5) * 2.0**-53


def to_normals(pairs: np.ndarray) -> np.ndarray:
    """Return standard normal numbers (...) float64 of uniform ones (2, ...), by the transform of Box and Muller 1958."""
    return np.sqrt(-2.0 * np.log(pairs[0])) * np.cos(2.0 * np.pi * pairs[1])
