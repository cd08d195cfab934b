"""What an approximation of the light may be wrong by, as each one declares it beside its method."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Limit = Literal["method", "input"]
PSF = "point spread function"  # effect of the terms of kernels
WINGS = "wings of diffraction"  # effect of the term of light from beyond them


@dataclass(frozen=True)
class ErrorTerm:
    """One cause of error of the mean light.

    effect: what is approximated, by its pass. cause: the approximation. sigma: largest size that 99.9 % of the photosites keep
    below [standard deviations of the noise]. fix: what makes it smaller; "": nothing that a user can give.
    limit: "method" for an approximation of what the scene holds; "input" for what the scene does not hold, such as a surface
    behind another, which no method can know. falls: whether a plan for a smaller tolerance has a smaller term. is_rare: whether
    most scenes stay far below, so that what falls is not left as coarse as it.
    """

    effect: str
    cause: str
    sigma: float
    fix: str = ""
    limit: Limit = "method"
    falls: bool = False
    is_rare: bool = False


@dataclass(frozen=True)
class Skipped:
    """An effect that is left out. reason: why. sigma: error of the light without it [standard deviations of the noise]."""

    reason: str
    sigma: float = 0.0


def together(sigmas: Iterable[float]) -> float:
    """Return the error of several causes: the largest, and the root of the sum of squares of the others.

    Errors have signs of their own from place to place. But where one is large, as beside an edge, the next one may be, too.
    """
    largest, *others = sorted(sigmas, reverse=True) or [0.0]
    return largest + math.hypot(*others)
