"""HDR read-out: one frame from several readings, of one charge at several gains, of several exposures or photodiodes."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.sensor.stages.stage import Photodiode

MOST_READINGS = 4
LARGEST_DN = 65535  # of a raw file


@dataclass(frozen=True)
class Companding:
    """Piecewise linear compression of the combined signal to fewer bits.

    bits: of the stored codes, 8 to 16.
    knees: points [signal, code] at which the slope changes, both in DN, ascending; the curve begins at [0, 0] and ends at
        the white level and the greatest code.
    """

    bits: int
    knees: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        require(8 <= self.bits <= 16, "camera.hdr_readout.companding.bits", self.bits, "raw files hold 8 to 16 bits")

    def decoding(self, white_dn: int) -> np.ndarray:
        """Return the signal [DN] of each code, (codes,) uint16, ascending (DNG LinearizationTable).

        white_dn: white level of the signal. Raises PhotositeError for knees that do not ascend up to it, or for codes that lie
        closer than 1 DN.
        """
        key, greatest = "camera.hdr_readout.companding", 2**self.bits - 1
        points = [(0.0, 0.0), *self.knees, (float(white_dn), float(greatest))]
        ascends = all(a[0] < b[0] and a[1] < b[1] for a, b in itertools.pairwise(points))
        rule = f"give points [signal, code] that ascend to [{white_dn}, {greatest}], the white level and the greatest code"
        require(ascends, f"{key}.knees", [list(knee) for knee in self.knees], rule)
        levels_dn, codes = zip(*points, strict=True)
        table = np.floor(np.interp(np.arange(greatest + 1), codes, levels_dn) + 0.5)
        rule = (
            "some codes lie closer together than 1 DN of the signal, so that they tell nothing; take fewer bits or lower codes"
        )
        require(bool((np.diff(table) >= 1).all()), key, f"{self.bits} bits", rule)
        return table.astype(np.uint16)

    def encode(self, signal_dn: np.ndarray, white_dn: int) -> np.ndarray:
        """Return the codes of signals [DN], rounded to the nearest, ties to even, as intp."""
        points = [(0.0, 0.0), *self.knees, (float(white_dn), float(2**self.bits - 1))]
        levels_dn, codes = zip(*points, strict=True)
        return np.rint(np.interp(signal_dn, levels_dn, codes)).astype(np.intp)


@dataclass(frozen=True)
class HdrReadout:
    """Several readings of one frame, combined: for each photosite the first one that is below its switch point.

    exposures: exposure time of each reading as a share of the shot's, 1 first, not ascending. Readings with equal shares read
        the same charge (dual gain) where they have the same light, too; others are exposed one after the other, the first from
        the release on.
    gains: gain of each reading relative to that of the ISO, 1 first: a reading with 0.125 is read as the camera reads at an
        eighth of the ISO, with the gain, noise and levels that were measured there.
    switch_at: switch point of a reading, as a share of its range from black to white, 0.1 to 0.99.
    companding: of the combined signal; left out: the file holds it as it is, in 16 bits.
    light: electrons that each reading collects in the same light and time, relative to the first, 1 first, none above 1.
        Readings with equal light are of one photodiode; another light is another photodiode under the same lens, with a charge
        of its own (split pixels).
    full_wells, dark_currents: of the photodiode of each reading, relative to `stages.full_well` and to `stages.dark_current`
        and `stages.hot_pixels`, which are those of the first one; 1 first.
    Raises PhotositeError for numbers that do not make the range of each reading greater than that of the one before, and for
    one photodiode with two full wells or dark currents.
    """

    exposures: tuple[float, ...] = ()
    gains: tuple[float, ...] = ()
    switch_at: float = 0.9
    companding: Companding | None = None
    light: tuple[float, ...] = ()
    full_wells: tuple[float, ...] = ()
    dark_currents: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        key = "camera.hdr_readout"
        count = max(len(self.exposures), len(self.gains), len(self.light))
        rule = f"give exposures, gains or light of 2 to {MOST_READINGS} readings"
        require(2 <= count <= MOST_READINGS, key, f"{count} readings", rule)
        for name in ("exposures", "gains", "light", "full_wells", "dark_currents"):
            shares, rule = getattr(self, name), f"give one for each of the {count} readings, or leave all of them out"
            require(len(shares) in (0, count), f"{key}.{name}", list(shares), rule)
            object.__setattr__(self, name, tuple(shares) or (1.0,) * count)
        falls = all(b <= a for a, b in itertools.pairwise(self.exposures))
        rule = "give 1 first, then shares above 0 that do not ascend, such as [1, 0.0625]"
        require(falls and _are_shares(self.exposures), f"{key}.exposures", list(self.exposures), rule)
        rule = "give 1 first, then shares above 0 and up to 1, such as [1, 0.0625]"
        for name, shares in (("gains", self.gains), ("light", self.light)):
            require(_are_shares(shares), f"{key}.{name}", list(shares), rule)
        self._check_photodiodes(key)
        products = [math.prod(one) for one in zip(self.exposures, self.gains, self.light, strict=True)]
        falls = all(b < a for a, b in itertools.pairwise(products))
        rule = "each reading needs less exposure, gain or light than the one before; give falling numbers, such as [1, 1/16]"
        name = "gains" if set(self.light) == {1.0} else "light"
        require(falls, f"{key}.{name}", list(getattr(self, name)), rule)
        rule = "give a share of a reading's range from 0.1 to 0.99, such as 0.9"
        require(0.1 <= self.switch_at <= 0.99, f"{key}.switch_at", self.switch_at, rule)

    def _check_photodiodes(self, key: str) -> None:
        """Raise PhotositeError for wells and dark currents out of range, and for one photodiode that is said to be two."""
        for name, least in (("full_wells", 1e-6), ("dark_currents", 0.0)):
            ratios = getattr(self, name)
            good = ratios[0] == 1.0 and all(least <= ratio < math.inf for ratio in ratios)
            rule = "give 1 first, then numbers relative to the first photodiode's, such as [1, 0.5]"
            require(good, f"{key}.{name}", list(ratios), rule)
            is_one = len(set(zip(self.light, ratios, strict=True))) == len(set(self.light))
            rule = "readings of equal light are of one photodiode; give them the same number, or another light"
            require(is_one, f"{key}.{name}", list(ratios), rule)
        rule = "readings of the same exposure and light read one charge; give them one after the other"
        require(max(self.charge_of) + 1 == len(set(self._charges)), f"{key}.light", list(self.light), rule)

    @property
    def _charges(self) -> list[tuple[float, float]]:
        return list(zip(self.exposures, self.light, strict=True))

    @property
    def charge_of(self) -> tuple[int, ...]:
        """Which charge each reading reads, from 0 on: one for each photodiode and exposure."""
        return (0, *itertools.accumulate(a != b for a, b in itertools.pairwise(self._charges)))

    @property
    def diode_of(self) -> tuple[int, ...]:
        """Which photodiode each reading belongs to, from 0 on."""
        found = tuple(dict.fromkeys(self.light))
        return tuple(found.index(share) for share in self.light)

    @property
    def photodiodes(self) -> tuple[Photodiode, ...]:
        """The photodiode of each reading."""
        return tuple(Photodiode(*numbers) for numbers in zip(self.light, self.full_wells, self.dark_currents, strict=True))

    def light_share(self, place: int) -> float:
        """Return the light of a reading as a share of that of the first reading of its exposure."""
        return self.light[place] / self.light[self.exposure_of.index(self.exposure_of[place])]

    @property
    def exposure_of(self) -> tuple[int, ...]:
        """Which exposure each reading belongs to, from 0 on."""
        changes = [a != b for a, b in itertools.pairwise(self.exposures)]
        return (0, *itertools.accumulate(changes))

    @property
    def exposure_shares(self) -> tuple[float, ...]:
        """Share of the exposure time of each exposure, one after the other."""
        return tuple(dict.fromkeys(self.exposures))


def _are_shares(shares: Sequence[float]) -> bool:
    return shares[0] == 1.0 and all(0 < share <= 1 for share in shares)
