"""HDR read-out: one frame from several readings, of one charge at several gains or of several exposures."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.errors import require

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
        the same charge (dual gain); others are exposed one after the other, the first from the release on.
    gains: gain of each reading relative to that of the ISO, 1 first: a reading with 0.125 is read as the camera reads at an
        eighth of the ISO, with the gain, noise and levels that were measured there.
    switch_at: switch point of a reading, as a share of its range from black to white, 0.1 to 0.99.
    companding: of the combined signal; left out: the file holds it as it is, in 16 bits.
    Raises PhotositeError for shares and gains that do not make the range of each reading greater than that of the one before.
    """

    exposures: tuple[float, ...] = ()
    gains: tuple[float, ...] = ()
    switch_at: float = 0.9
    companding: Companding | None = None

    def __post_init__(self) -> None:
        key = "camera.hdr_readout"
        count = max(len(self.exposures), len(self.gains))
        require(
            2 <= count <= MOST_READINGS, key, f"{count} readings", f"give exposures or gains of 2 to {MOST_READINGS} readings"
        )
        for name, shares in (("exposures", self.exposures), ("gains", self.gains)):
            rule = f"give one for each of the {count} readings, or leave all of them out"
            require(len(shares) in (0, count), f"{key}.{name}", list(shares), rule)
            object.__setattr__(self, name, tuple(shares) or (1.0,) * count)
        for name, shares in (("exposures", self.exposures), ("gains", self.gains)):
            self._check_shares(f"{key}.{name}", shares)
        products = [share * gain for share, gain in zip(self.exposures, self.gains, strict=True)]
        falls = all(b < a for a, b in itertools.pairwise(products))
        rule = "each reading needs less exposure or less gain than the one before; give falling numbers, such as [1, 1/16]"
        require(falls, f"{key}.gains", list(self.gains), rule)
        rule = "give a share of a reading's range from 0.1 to 0.99, such as 0.9"
        require(0.1 <= self.switch_at <= 0.99, f"{key}.switch_at", self.switch_at, rule)

    @staticmethod
    def _check_shares(key: str, shares: Sequence[float]) -> None:
        good = shares[0] == 1.0 and all(0 < b <= a for a, b in itertools.pairwise(shares))
        require(good, key, list(shares), "give 1 first, then shares above 0 that do not ascend, such as [1, 0.0625]")

    @property
    def exposure_of(self) -> tuple[int, ...]:
        """Which exposure each reading belongs to, from 0 on."""
        changes = [a != b for a, b in itertools.pairwise(self.exposures)]
        return (0, *itertools.accumulate(changes))

    @property
    def exposure_shares(self) -> tuple[float, ...]:
        """Share of the exposure time of each exposure, one after the other."""
        return tuple(dict.fromkeys(self.exposures))
