"""Where on a path its instants lie: denser at both ends, where the light that a photosite gathers begins in the dark.

An edge that a photosite reaches only at the end of its path, or leaves at its beginning, gives it little light: an error
is seen in the noise of the dark. An edge in the middle gives it light whose own noise hides more. Let x be the share of the
path between an edge and the nearer end, and L the length of the path [photosites]. The ramp of the edge, one photosite wide,
gives the photosite at least the share q = L x^2 / 2 of the edge's step, or (s - 1/2) / L from s = L x = 1 on. Contrast in the
noise of that light is c(q), with 1 / c^2 linear in q for each edge, so that for the largest of all edges
1 / c(q)^2 >= 1 / c(0)^2 + (1 / c(a)^2 - 1 / c(0)^2) q / a up to q = a. An interval of the share d at x is wrong by c L d^2 / 8
(`instants`): the error is the same everywhere where d^2 grows as 1 / c.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

LIT_SHARE = 0.1  # of an edge's step, by which a photosite is lit where the edge counts as not in the dark
NODES = 4096  # of the integral over half of a path, denser towards its end


@dataclass(frozen=True)
class EndSpacing:
    """Spacing of the instants of a path.

    even_px: length of the path, as of `PathLength`. dark: contrast of edges in the noise of their darker pixel, as a share of
    that in the noise of that pixel and LIT_SHARE of their step, >= 1.
    """

    even_px: float
    dark: float

    @cached_property
    def _integral(self) -> tuple[np.ndarray, np.ndarray]:
        """Shares of the path from its beginning to its middle, and the integral of 1 / d up to each."""
        share = 0.5 * np.linspace(0.0, 1.0, NODES) ** 2
        passed_px = self.even_px * share
        reached = np.where(passed_px < 1.0, 0.5 * passed_px**2, passed_px - 0.5) / max(self.even_px, 1e-12)
        least = 1.0 / self.dark**2
        density = (least + (1.0 - least) * np.minimum(reached / LIT_SHARE, 1.0)) ** -0.25
        steps = 0.5 * (density[1:] + density[:-1]) * np.diff(share)
        return share, np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def excess(self) -> float:
        """How many times as many instants as even ones keep the middle of the path as exact, >= 1."""
        return 2.0 * float(self._integral[1][-1])

    def borders(self, count: int) -> np.ndarray:
        """Return the borders of so many intervals as shares of the path, (count + 1,) from 0 to 1."""
        share, integral = self._integral
        wanted = np.linspace(0.0, 2.0 * integral[-1], count + 1)
        first = np.interp(np.minimum(wanted, wanted[::-1]), integral, share)
        return np.where(wanted <= integral[-1], first, 1.0 - first)
