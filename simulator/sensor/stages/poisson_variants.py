"""Which code of kernels/poisson.h counts which means."""

from enum import IntEnum

import numpy as np

POISSON_SWITCH_E = 5.0  # below this mean the Poisson expansion is off by more than 1e-4; kernels/poisson.h inverts there
POISSON_BRIGHT_E = 256.0  # from this mean up two orders of the expansion do (total variation distance below 1e-5)
MACROS = {"POISSON_SWITCH": f"{POISSON_SWITCH_E}f", "POISSON_BRIGHT": f"{POISSON_BRIGHT_E}f"}
SMALL_MEANS_E = (POISSON_SWITCH_E, 2.0, 0.5)  # greatest means of SMALL, SMALLER, SMALLEST


class PoissonMeans(IntEnum):
    """Means that a call can count, as kernels/poisson.h numbers them."""

    LARGE = 0
    ALL = 1
    SMALL = 2
    SMALLER = 3
    SMALLEST = 4
    BRIGHT = 5


SMALL_VARIANTS = (PoissonMeans.SMALL, PoissonMeans.SMALLER, PoissonMeans.SMALLEST)


def poisson_means(least_e: np.ndarray | float, greatest_e: np.ndarray | float) -> np.ndarray:
    """PoissonMeans that suffice between least and greatest mean [e-], element by element."""
    means = np.where(np.asarray(least_e) >= POISSON_SWITCH_E, PoissonMeans.LARGE, PoissonMeans.ALL)
    for limit_e, variant in zip(SMALL_MEANS_E, SMALL_VARIANTS, strict=True):
        means = np.where(np.asarray(greatest_e) < limit_e, variant, means)
    return np.where(np.asarray(least_e) >= POISSON_BRIGHT_E, PoissonMeans.BRIGHT, means)
