"""Exposure: shutter, time, ISO and flash, as set by hand or by the camera. H = E t (ISO 12232:2019)."""

import math
from dataclasses import dataclass
from datetime import datetime

from simulator.errors import PhotositeError, require
from simulator.exposure.dials import AutoIso, Dials, Mode
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.metering import Metering
from simulator.exposure.shutter import AnyShutter
from simulator.units import Seconds

_DATE_TIME = "%Y-%m-%d %H:%M:%S"
_BY_HAND = ("manual", "shutter_priority")  # modes in which the photographer sets the time
MOST_COMPENSATION_STOPS = 30.0


@dataclass(frozen=True)
class Exposure:
    """What the photographer sets, and what the lamps do.

    time_s: open time of the shutter [s], > 0; left out where the camera chooses it.
    iso: exposure index; it chooses the camera's analog gain. With auto_iso the lowest.
    date_time: when the picture is taken, such as 2026-05-01 12:30:00, for the file's metadata; no date when left out,
        since a clock's would make each file another.
    start_s: when the shutter is released, on the clock of what moves and of the lamps [s].
    shutter: how lines are opened, told apart by its keys: curtains, rolling, electronic first curtain, leaf, or global with
        parasitic light; left out: all lines are open at the same time.
    flicker: how the light on the scene changes, told apart by its keys: mains or pulses; left out: it is steady.
    flash: fired while the shutter is open; left out: none.
    mode: manual; aperture_priority chooses the time; shutter_priority the f-number; programme both; auto also the ISO. The
        camera chooses when the shot is planned, and the plan has a manual exposure.
    compensation: stops that the picture gets more than the meter finds.
    metering: how the camera meters; in manual mode without auto_iso for the report alone.
    auto_iso: when the ISO rises; left out: it stays, except in mode auto.
    dials: what the dials can be set to; left out: thirds of a stop, 1/8000 s to 30 s, up to f/22.
    Raises PhotositeError when time or ISO is not positive, time not finite, the date none of the calendar, and for settings
    that the mode does not use.
    """

    time_s: Seconds = 0.0
    iso: int = 100
    date_time: str | None = None
    start_s: Seconds = 0.0
    shutter: AnyShutter | None = None
    flicker: MainsFlicker | PwmLamp | None = None
    flash: Flash | None = None
    mode: Mode = "manual"
    compensation: float = 0.0
    metering: Metering | None = None
    auto_iso: AutoIso | None = None
    dials: Dials | None = None

    def __post_init__(self) -> None:
        stated = f"{self.time_s:g} s"
        if self.mode in _BY_HAND:
            rule = "write for example `time: 1/125 s`, or `mode: aperture_priority`, in which the camera chooses it"
            if self.time_s == 0:
                needs = f"the shutter must open and close, so that mode {self.mode} needs a time"
                raise PhotositeError(f"{needs}; {rule}", key="exposure.time")
            require(0 < self.time_s < math.inf, "exposure.time", stated, f"the shutter must open and close; {rule}")
        else:
            rule = f"mode {self.mode} chooses the time; leave it out, or write mode: shutter_priority"
            require(self.time_s == 0, "exposure.time", stated, rule)
        require(self.iso > 0, "exposure.iso", self.iso, "give a positive ISO, such as 100")
        require(math.isfinite(self.start_s), "exposure.start", f"{self.start_s:g} s", "give a finite time, such as 0.1 s")
        rule = "give a date of the calendar and a time as 2026-05-01 12:30:00"
        require(self.date_time is None or _is_date_time(self.date_time), "exposure.date_time", self.date_time, rule)
        rule = f"give stops from {-MOST_COMPENSATION_STOPS:g} to {MOST_COMPENSATION_STOPS:g}, such as 1 or -0.7"
        is_far, value = not abs(self.compensation) <= MOST_COMPENSATION_STOPS, f"{self.compensation:g}"
        require(not is_far, "exposure.compensation", value, rule)
        rule = "nothing is metered in mode manual; give auto_iso or metering, or another mode, such as aperture_priority"
        require(self.compensation == 0 or self.is_metered, "exposure.compensation", value, rule)
        require(self.dials is None or self.is_metered, "exposure.dials", "given", rule)

    @property
    def is_metered(self) -> bool:
        """Whether a meter reads the scene: to choose a setting, or to report."""
        return self.mode != "manual" or self.auto_iso is not None or self.metering is not None


def _is_date_time(text: str) -> bool:
    try:
        return len(text) == 19 and bool(datetime.strptime(text, _DATE_TIME))
    except ValueError:
        return False
