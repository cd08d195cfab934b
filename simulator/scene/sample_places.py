"""Places at which large scenes are looked at, where not all of their pixels need be."""

import numpy as np

GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def sample_places(length: int, most: int) -> np.ndarray:
    """Return numbers below `length`, ascending: all, or `most` of them, one in each of as many equal parts.

    Places within parts are multiples of the golden ratio, so that no pattern repeats with them: even steps see squares as wide
    as they are at the same place of each, and none of their edges.
    """
    if length <= most:
        return np.arange(length)
    number = np.arange(most)
    return ((number + number * GOLDEN % 1.0) * (length / most)).astype(np.int64)
