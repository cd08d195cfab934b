"""Lattice points of low discrepancy: Korobov's rank-1 lattices (Sloan and Joe, Lattice Methods, 1994).

Point i of n is the fraction of i (1, a, a^2, ...) / n. On products of an aperture and a time they are twice as exact as as many
Sobol' points, because no plane through a lattice holds many of its points.
"""

import numpy as np

# Of each number of points, the multiplier a with the least figure P_2 in four dimensions among those whose P_2 in three lies
# within 15 % of the least; of 4096 and 8192 points, among 500 multipliers.
MULTIPLIERS = {32: 3, 64: 5, 128: 59, 256: 37, 512: 119, 1024: 367, 1536: 139, 2048: 719, 4096: 285, 8192: 5397}


def lattice_points(count: int, dimensions: int) -> np.ndarray:
    """Return the points (count, dimensions) float64 from 0 to 1. count: of MULTIPLIERS."""
    multiplier, number = MULTIPLIERS[count], np.arange(count)
    steps = [pow(multiplier, power, count) for power in range(dimensions)]
    return np.stack([(number * step % count + 0.5) / count for step in steps], axis=-1)
