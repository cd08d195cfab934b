"""Blooming: charge beyond the full well spills into neighbouring photosites."""

from dataclasses import dataclass
from typing import Literal

from simulator.errors import require

MOST_REACH_PX = 1024


@dataclass(frozen=True)
class Blooming:
    """Charge above the full well leaves a photosite in equal shares, and fills the wells that it comes by.

    Each share moves straight on, photosite by photosite. It fills what room a well has, shares that arrive together in
    proportion to their size, and the rest moves on. What has found no room after `reach` photosites, or leaves the sensor, is
    drained, as by an anti-blooming gate. All other charge is conserved. Charge is counted before, so it has its shot noise;
    it passes the barriers of a column of a CCD, or to all four neighbours (Janesick 2001, Scientific charge-coupled devices).

    neighbours: column moves charge up and down, as in a CCD, whose columns are parted by channel stops; four also left and
        right.
    reach: photosites that charge moves on at most, 1 to 1024.
    """

    neighbours: Literal["column", "four"] = "column"
    reach: int = 64

    def __post_init__(self) -> None:
        key = "camera.blooming"
        require(self.neighbours in ("column", "four"), f"{key}.neighbours", self.neighbours, "give column or four")
        rule = f"give 1 to {MOST_REACH_PX} photosites"
        require(1 <= self.reach <= MOST_REACH_PX, f"{key}.reach", self.reach, rule)

    @property
    def sides(self) -> int:
        """Directions in which charge leaves a photosite."""
        return 2 if self.neighbours == "column" else 4

    @property
    def reach_px(self) -> tuple[int, int]:
        """Photosites on either side that affect one: in its row, and in its column."""
        return (0 if self.neighbours == "column" else self.reach), self.reach
