"""Points of low discrepancy: Sobol' points in five dimensions, up to 8192, scrambled once (Matousek 1998)."""

import numpy as np

BITS = 30
# For each dimension the scrambled zero and the 13 direction numbers, those of scipy.stats.qmc.Sobol(5, seed=1), whose import
# takes longer than a small frame. `tests/optics/defocus/test_sobol_points.py` compares them with SciPy.
# fmt: off
NUMBERS = (
    (166929614, 584705160, 390638702, 173840047, 101773626, 65012098, 26279561,
     11815240, 5605210, 2130703, 1084939, 912286, 283853, 239779),
    (632162628, 943134078, 581917051, 935523224, 730323435, 989987716, 551903398,
     874072540, 692556980, 939822485, 579156983, 939410613, 732239811, 993133584),
    (652332706, 800667995, 1055693001, 416336149, 719519818, 905071197, 399128450,
     750419880, 1070025972, 443899871, 688731811, 879775099, 354232322, 799045912),
    (260275007, 870311056, 543547723, 234392107, 383406201, 709766533, 438100777,
     1051081153, 912655814, 664378494, 209928487, 336533839, 739536805, 429051534),
    (908052149, 911799038, 290784176, 211530668, 1007549054, 799411894, 583380662,
     426326918, 871250972, 366211066, 256124384, 983659249, 762555041, 596196120),
)
# fmt: on
MOST = 2 ** (len(NUMBERS[0]) - 1)


def sobol_points(count: int) -> np.ndarray:
    """Return the first points, (count, 5) float64 from 0 to 1, in the order of the Gray code (Antonov and Saleev 1979).

    Those of a power of two are evenly spread. Raises ValueError for a count above MOST.
    """
    if count > MOST:
        raise ValueError(f"{count} points; there are {MOST}")
    number = np.arange(count)
    gray = number ^ (number >> 1)
    points = np.empty((count, len(NUMBERS)))
    for dimension, (zero, *directions) in enumerate(NUMBERS):
        digits = np.full(count, zero)
        for bit, direction in enumerate(directions):
            digits ^= np.where(gray >> bit & 1, direction, 0)
        points[:, dimension] = digits * 2.0**-BITS
    return points
