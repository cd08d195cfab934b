"""Lattice points of low discrepancy: Korobov's rank-1 lattices (Sloan and Joe, Lattice Methods, 1994).

Point i of n is the fraction of i (1, a, a^2, ...) / n. On products of an aperture and a time they are twice as exact as as many
Sobol' points, because no plane through a lattice holds many of its points.
"""

import numpy as np

# Of each number of points, a multiplier a of small figures P_2 in three and four dimensions. P_2 does not order what is left of
# disks that move: of 256, 1024, 1536, 2048 and 4096 points it is one of some dozen of small P_2, with little error of disks and
# of layers on their paths; of 1024 and 4096 with small P_2 in six dimensions, too, of which photosites have two.
MULTIPLIERS = {32: 3, 64: 5, 128: 59, 256: 201, 512: 119, 1024: 131, 1536: 583, 2048: 893, 4096: 1227, 8192: 5397}


def lattice_points(count: int, dimensions: int) -> np.ndarray:
    """Return the points (count, dimensions) float64 from 0 to 1. count: of MULTIPLIERS."""
    multiplier, number = MULTIPLIERS[count], np.arange(count)
    steps = [pow(multiplier, power, count) for power in range(dimensions)]
    return np.stack([(number * step % count + 0.5) / count for step in steps], axis=-1)
