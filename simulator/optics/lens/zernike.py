"""Zernike polynomials on the unit disk, numbered and normalised as in Noll 1976 (J. Opt. Soc. Am. 66, 207)."""

import math

import numpy as np

from simulator.errors import require

LARGEST_INDEX = 231  # radial order 20


def noll_orders(index: int) -> tuple[int, int]:
    """Radial order n and azimuthal order m of Noll's index: m > 0 goes with the cosine, m < 0 with the sine.

    Raises PhotositeError for an index outside 1 to 231.
    """
    require(1 <= index <= LARGEST_INDEX, "zernike index", index, f"give Noll's index, 1 to {LARGEST_INDEX}")
    n = math.isqrt(8 * index - 7) // 2
    n = n - 1 if n * (n + 1) // 2 >= index else n
    place = index - n * (n + 1) // 2 - 1
    m = 2 * ((place + 1 + n % 2) // 2) - n % 2
    return n, (m if index % 2 == 0 else -m)


def zernike(index: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Noll's polynomial at pupil points, same shape as x and y: its mean square over the unit disk is 1."""
    from scipy.special import eval_jacobi  # a fifth of a second, for those who have such terms

    n, m = noll_orders(index)
    order, radius, angle = abs(m), np.hypot(x, y), np.arctan2(y, x)
    lobes = (n - order) // 2
    # R_n^m(r) = (-1)^k r^m P_k^(m, 0)(1 - 2 r^2): Born and Wolf, 9.2.1.
    radial = (-1) ** lobes * radius**order * eval_jacobi(lobes, order, 0, 1.0 - 2.0 * radius**2)
    if m == 0:
        return math.sqrt(n + 1.0) * radial
    return math.sqrt(2.0 * (n + 1.0)) * radial * (np.cos(m * angle) if m > 0 else np.sin(order * angle))
