"""How many instants a path of images needs, even ones or those that lie denser at its ends, whichever are fewer."""

import math
from dataclasses import dataclass, replace
from typing import Self

from simulator.optics.geometry.end_spacing import EndSpacing
from simulator.optics.geometry.instants import MOST_INSTANTS, PathLength, needed_instants


@dataclass(frozen=True)
class SpacedInstants:
    """How many instants a path has, and where.

    count: of each line. spacing: of them; None: even. contrast: of edges, by which even ones are wrong. length: of the path.
    """

    count: int
    spacing: EndSpacing | None
    contrast: float
    length: PathLength

    @classmethod
    def even(cls, length: PathLength, dark: float, allowed: float, cut_off: float) -> Self:
        """Return even instants. dark: contrast of edges in the noise of their darker pixel; others as of `needed_instants`."""
        return cls(needed_instants(length, dark, allowed, cut_off), None, dark, length)

    @classmethod
    def fewest(cls, length: PathLength, contrast: float, dark: float, allowed: float, cut_off: float) -> Self:
        """Return even instants, or those denser at the ends where these are fewer and lie within a photosite."""
        even = cls.even(length, max(dark, contrast), allowed, cut_off)
        spacing = EndSpacing(length.even_px, even.contrast / contrast)
        middle = max(needed_instants(length, contrast, allowed, cut_off), length.longest_px)
        count = min(math.ceil(spacing.excess * middle - 1e-9), MOST_INSTANTS)
        return cls(count, spacing, contrast, length) if count < even.count else even

    def dense_at_ends(self, middle: float, darker: float) -> Self:
        """Return instants whose ends are as dense as lamps ask, or as these if that is more.

        middle: even ones as dense as the middle needs. darker: contrast of lamps in the noise of the dark, as a share of that
        in their own light.
        """
        darker = max(darker, 1.0 if self.spacing is None else self.spacing.dark)
        spacing = EndSpacing(self.length.even_px, darker)
        return replace(self, count=min(math.ceil(spacing.excess * middle - 1e-9), MOST_INSTANTS), spacing=spacing)

    @property
    def excess(self) -> float:
        """How many times as many instants as even ones keep the middle of the path as exact, >= 1."""
        return 1.0 if self.spacing is None else self.spacing.excess
