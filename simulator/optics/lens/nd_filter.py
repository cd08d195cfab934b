"""Neutral density filters, by what is engraved on them."""

import math
from dataclasses import dataclass

from simulator.errors import require


@dataclass(frozen=True)
class NeutralDensity:
    """Grey filter before the lens: T = 10^-D = 2^-stops = 1 / factor. One of the three is given, as it is marked.

    density: optical density D, such as 0.9; a stop is log10(2) = 0.30103, so that D = 0.3 is 0.997 stops.
    stops: such as 3.
    factor: by which the time grows, such as 8 (ND8).
    Raises PhotositeError unless one of them is given, and lets 10^-12 to all of the light pass.
    """

    density: float | None = None
    stops: float | None = None
    factor: float | None = None

    def __post_init__(self) -> None:
        given = [name for name, value in vars(self).items() if value is not None]
        rule = "give one of density, stops and factor, as the filter is marked, such as {density: 0.9}"
        require(len(given) == 1, "lens.nd_filter", ", ".join(given) or "{}", rule)
        name = given[0]
        value = getattr(self, name)
        least, most = {"density": (0.0, 12.0), "stops": (0.0, 40.0), "factor": (1.0, 1e12)}[name]
        rule = f"give {least:g} to {most:g}"
        require(math.isfinite(value) and least <= value <= most, f"lens.nd_filter.{name}", value, rule)

    @property
    def transmittance(self) -> float:
        """Share of the light that passes."""
        if self.density is not None:
            return 10.0**-self.density
        if self.stops is not None:
            return 2.0**-self.stops
        assert self.factor is not None  # one of three is given
        return 1.0 / self.factor


def filter_transmittance(nd_filter: NeutralDensity | None) -> float:
    """Return the share of the light that a filter lets pass; 1 without one."""
    return 1.0 if nd_filter is None else nd_filter.transmittance
