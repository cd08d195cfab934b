"""Exposure: shutter, time, ISO and flash. H = E t (ISO 12232:2019)."""

import math
from dataclasses import dataclass
from datetime import datetime

from simulator.errors import require
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.shutter import AnyShutter
from simulator.units import Seconds

_DATE_TIME = "%Y-%m-%d %H:%M:%S"


@dataclass(frozen=True)
class Exposure:
    """What the photographer sets, and what the lamps do.

    time_s: open time of the shutter [s], > 0.
    iso: exposure index; it chooses the camera's analog gain.
    date_time: when the picture is taken, such as 2026-05-01 12:30:00, for the file's metadata; no date when left out,
        since a clock's would make each file another.
    start_s: when the shutter is released, on the clock of what moves and of the lamps [s].
    shutter: how lines are opened, told apart by its keys: curtains, rolling, electronic first curtain, leaf, or global with
        parasitic light; left out: all lines are open at the same time.
    flicker: how the light on the scene changes, told apart by its keys: mains or pulses; left out: it is steady.
    flash: fired while the shutter is open; left out: none.
    Raises PhotositeError when time or ISO is not positive, time not finite, or the date none of the calendar.
    """

    time_s: Seconds
    iso: int = 100
    date_time: str | None = None
    start_s: Seconds = 0.0
    shutter: AnyShutter | None = None
    flicker: MainsFlicker | PwmLamp | None = None
    flash: Flash | None = None

    def __post_init__(self) -> None:
        rule = "the shutter must open and close: give a time above 0 s, such as 1/125 s"
        require(0 < self.time_s < math.inf, "exposure.time", f"{self.time_s:g} s", rule)
        require(self.iso > 0, "exposure.iso", self.iso, "give a positive ISO, such as 100")
        require(math.isfinite(self.start_s), "exposure.start", f"{self.start_s:g} s", "give a finite time, such as 0.1 s")
        rule = "give a date of the calendar and a time as 2026-05-01 12:30:00"
        require(self.date_time is None or _is_date_time(self.date_time), "exposure.date_time", self.date_time, rule)


def _is_date_time(text: str) -> bool:
    try:
        return len(text) == 19 and bool(datetime.strptime(text, _DATE_TIME))
    except ValueError:
        return False
