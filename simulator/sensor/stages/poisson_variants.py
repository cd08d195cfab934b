"""Variants of the Poisson code of kernels/poisson.h, and the ranges of means that they serve."""

from enum import IntEnum

import numpy as np

POISSON_SWITCH_E = 5.0  # below this mean the error of the expansion exceeds 1e-4; kernels/poisson.h uses inversion there
POISSON_BRIGHT_E = 256.0  # from this mean up two orders of the expansion suffice (total variation distance below 1e-5)
MACROS = {"POISSON_SWITCH": f"{POISSON_SWITCH_E}f", "POISSON_BRIGHT": f"{POISSON_BRIGHT_E}f"}
SMALL_MEANS_E = (POISSON_SWITCH_E, 2.0, 0.5)  # greatest means of SMALL, SMALLER, SMALLEST


class PoissonVariant(IntEnum):
    """Range of means that the Poisson code is compiled for, as kernels/poisson.h numbers them."""

    LARGE = 0
    ALL = 1
    SMALL = 2
    SMALLER = 3
    SMALLEST = 4
    BRIGHT = 5


SMALL_VARIANTS = (PoissonVariant.SMALL, PoissonVariant.SMALLER, PoissonVariant.SMALLEST)


def choose_poisson_variants(least_e: np.ndarray | float, greatest_e: np.ndarray | float) -> np.ndarray:
    """Return, element by element, the fastest PoissonVariant that serves all means from least to greatest [e-]."""
    variants = np.where(np.asarray(least_e) >= POISSON_SWITCH_E, PoissonVariant.LARGE, PoissonVariant.ALL)
    for limit_e, variant in zip(SMALL_MEANS_E, SMALL_VARIANTS, strict=True):
        variants = np.where(np.asarray(greatest_e) < limit_e, variant, variants)
    return np.where(np.asarray(least_e) >= POISSON_BRIGHT_E, PoissonVariant.BRIGHT, variants)
