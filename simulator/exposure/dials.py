"""The dials of a camera: which time, aperture and ISO a metered exposure gets, and which limit decides."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from simulator.errors import require
from simulator.exposure.stops import f_number_of, thirds_of_f_number, thirds_of_time, time_of
from simulator.units import FNumber, Hertz, Seconds

Mode = Literal["manual", "aperture_priority", "shutter_priority", "programme", "auto"]
Steps = Literal["third", "whole", "free"]
HALF_THIRD = 0.5  # thirds of a stop by which a mark and its true stop may differ
HAND_HELD_S = 1.0 / 60.0  # longest time by hand where there is no focal length


@dataclass(frozen=True)
class Dials:
    """What the dials can be set to. Limits are marks: 30 s includes its true stop, 32 s.

    steps: dials stop at true thirds of a stop, or at whole stops; free: at any time, aperture and whole ISO.
    shortest_s, longest_s: times of the shutter [s].
    widest: f-number of the open aperture; left out: that of the lens.
    narrowest: f-number of the smallest aperture.
    """

    steps: Steps = "third"
    shortest_s: Seconds = 1.0 / 8000.0
    longest_s: Seconds = 30.0
    widest: FNumber | None = None
    narrowest: FNumber = 22.0

    def __post_init__(self) -> None:
        times = f"{self.shortest_s:g} s to {self.longest_s:g} s"
        good = 0 < self.shortest_s <= self.longest_s < math.inf
        require(good, "exposure.dials.shortest", times, "give a time above 0 s, up to exposure.dials.longest")
        rule = "give an f-number of 0.5 or more, such as f/22"
        for key, number in (("widest", self.widest), ("narrowest", self.narrowest)):
            require(number is None or 0.5 <= number < math.inf, f"exposure.dials.{key}", f"f/{number or 0:g}", rule)
        ends = f"f/{self.narrowest:g}"
        wide = self.widest is None or self.widest <= self.narrowest
        require(wide, "exposure.dials.narrowest", ends, "give an f-number not below exposure.dials.widest")

    def time_s(self, wanted_s: float, limits: list[str]) -> float:
        """Return the time on the dial nearest to a wanted one; adds to `limits` the one that keeps it away."""
        held = min(max(wanted_s, self.shortest_s), self.longest_s)
        if held != wanted_s:
            limits.append(f"{'shortest' if held > wanted_s else 'longest'} time")
        return held if self.steps == "free" else self._on_dial(held, thirds_of_time, time_of, self.shortest_s, self.longest_s)

    def f_number(self, wanted: float, widest: float, limits: list[str]) -> float:
        """Return the f-number on the dial nearest to a wanted one, as `time_s` does; the open aperture is on any dial."""
        narrowest = max(self.narrowest, widest)
        held = min(max(wanted, widest), narrowest)
        if held != wanted:
            limits.append(f"{'widest' if held > wanted else 'narrowest'} aperture")
        if self.steps == "free":
            return held
        found = self._on_dial(held, thirds_of_f_number, f_number_of, widest, narrowest)
        return widest if found <= widest or abs(math.log2(held / widest)) < abs(math.log2(held / found)) else found

    def _on_dial(
        self, value: float, place_of: Callable[[float], float], value_of: Callable[[float], float], least: float, most: float
    ) -> float:
        """Return the value at the step nearest to `value` that lies between the limits, half a third more on each side.

        `value` itself where the limits leave no step.
        """
        step = 3 if self.steps == "whole" else 1
        first, last = (
            math.ceil((place_of(least) - HALF_THIRD) / step) * step,
            math.floor((place_of(most) + HALF_THIRD) / step) * step,
        )
        place = min(max(round(place_of(value) / step) * step, first), last)
        return value_of(place) if first <= last else value


@dataclass(frozen=True)
class AutoIso:
    """ISO that rises where the time would get too long, or the aperture too wide.

    highest: ISO up to which it rises; left out: the highest of the camera.
    longest_s: time from which on the ISO rises [s]; left out: 1 s over the focal length in mm on 36 mm x 24 mm.
    mains_hz: frequency of the mains, whose lamps flicker twice as fast: a time of a period of the lamps or more becomes a whole
        number of periods, and the ISO takes the rest; left out: any time.
    """

    highest: int | None = None
    longest_s: Seconds | None = None
    mains_hz: Hertz | None = None

    def __post_init__(self) -> None:
        require(self.highest is None or self.highest > 0, "exposure.auto_iso.highest", self.highest, "an ISO is above 0")
        good = self.longest_s is None or 0 < self.longest_s < math.inf
        require(good, "exposure.auto_iso.longest", f"{self.longest_s} s", "give a time above 0 s, such as 1/60 s")
        good = self.mains_hz is None or 0 < self.mains_hz < math.inf
        require(good, "exposure.auto_iso.mains", f"{self.mains_hz} Hz", "give the frequency of the mains, such as 50 Hz")


@dataclass(frozen=True)
class Settings:
    """Time [s], f-number and ISO that are set on a camera."""

    time_s: float
    f_number: float
    iso: int


@dataclass(frozen=True)
class Body:
    """What the solution of an exposure needs of lens and camera.

    solid_angle_sr: irradiance per radiance at an f-number [sr]. white_e: electrons at white at an ISO [e-].
    f_number_for: f-number that gives a solid angle. isos: ISOs of the camera's dial, ascending. has_iso: whether an ISO between
    them can be set, too. widest: f-number of the open aperture. hand_held_s: longest time that is not shaken by hand [s].
    """

    solid_angle_sr: Callable[[float], float]
    white_e: Callable[[int], float]
    f_number_for: Callable[[float], float]
    isos: tuple[int, ...]
    has_iso: Callable[[int], bool]
    widest: float
    hand_held_s: float


@dataclass(frozen=True)
class Solution:
    """Settings, how far the exposure is above the wanted one [stops], and the limits that kept it away."""

    settings: Settings
    deviation_stops: float
    limits: tuple[str, ...]


@dataclass
class ExposureSolver:
    """Finds the settings of a mode.

    wanted: exposure over electrons at white, time * solid angle / white. start: what is set by hand; of a mode that chooses
    it, a value is not used, but the ISO is the lowest.
    """

    mode: Mode
    wanted: float
    start: Settings
    dials: Dials
    auto_iso: AutoIso | None
    body: Body
    limits: list[str] = field(default_factory=list)

    def solve(self) -> Solution:
        """Return the settings on the dials that come nearest to the wanted exposure."""
        start = self.start
        if self.mode == "manual":
            chosen = start if self.auto_iso is None else replace(start, iso=self._nearest_iso(start.time_s, start.f_number))
        elif self.mode == "aperture_priority":
            chosen = self._time_for_aperture(start.f_number)
        elif self.mode == "shutter_priority":
            chosen = self._aperture_for_time(start.time_s)
        else:
            chosen = self._programme()
        return Solution(chosen, self.deviation_stops(chosen), tuple(dict.fromkeys(self.limits)))

    def deviation_stops(self, chosen: Settings) -> float:
        """Return how far these settings are above the wanted exposure [stops]; minus infinity where it has no end."""
        if math.isinf(self.wanted):
            return -math.inf
        return math.log2(chosen.time_s / self._time_s(chosen.f_number, chosen.iso))

    def _time_s(self, f_number: float, iso: int) -> float:
        """Return the time that aperture and ISO need."""
        return self.wanted * self.body.white_e(iso) / self.body.solid_angle_sr(f_number)

    @property
    def _longest_s(self) -> float:
        """Time from which on the ISO rises, and aperture priority of the programme ends."""
        stated = None if self.auto_iso is None else self.auto_iso.longest_s
        return min(max(self.body.hand_held_s if stated is None else stated, self.dials.shortest_s), self.dials.longest_s)

    def _isos(self) -> list[int]:
        """ISOs that may be chosen, ascending: those of the camera from the one that is set to the highest allowed."""
        assert self.auto_iso is not None
        highest = self.body.isos[-1] if self.auto_iso.highest is None else self.auto_iso.highest
        between = [iso for iso in self.body.isos if self.start.iso < iso < highest]
        return [self.start.iso, *between, *([highest] if highest > self.start.iso else [])]

    def _nearest_iso(self, time_s: float, f_number: float) -> int:
        """Return the ISO whose exposure is nearest to the wanted one."""
        isos = self._isos()
        if math.isinf(self.wanted):
            self.limits.append("highest ISO")
            return isos[-1]
        excess = {iso: math.log2(time_s / self._time_s(f_number, iso)) for iso in isos}
        if excess[isos[-1]] < 0.0:
            self.limits.append("highest ISO")
        elif excess[isos[0]] > 0.0:
            self.limits.append("lowest ISO")
        if self.dials.steps != "free" or len(isos) == 1:
            return min(isos, key=lambda iso: abs(excess[iso]))
        place = min(max(sum(excess[iso] < 0.0 for iso in isos), 1), len(isos) - 1)
        low, high = isos[place - 1], isos[place]
        while high - low > 1 and self.body.has_iso(middle := (low + high) // 2):  # the gain rises with the ISO
            low, high = (middle, high) if time_s < self._time_s(f_number, middle) else (low, middle)
        return min((low, high), key=lambda iso: abs(math.log2(time_s / self._time_s(f_number, iso))))

    def _time_for_aperture(self, f_number: float) -> Settings:
        """Choose the time and, where it gets too long, the ISO."""
        iso, time_s = self.start.iso, self._time_s(f_number, self.start.iso)
        if self.auto_iso is not None:
            if time_s > self._longest_s:
                iso, time_s = self._higher_iso(f_number)
            if self.auto_iso.mains_hz is not None:
                period_s = 0.5 / self.auto_iso.mains_hz
                held_s = min(max(time_s, self.dials.shortest_s), self.dials.longest_s)
                if held_s >= period_s * (1.0 - 1e-9):
                    time_s = math.floor(held_s / period_s + 1e-9) * period_s
                    return Settings(time_s, f_number, self._nearest_iso(time_s, f_number))
        return Settings(self.dials.time_s(time_s, self.limits), f_number, iso)

    def _higher_iso(self, f_number: float) -> tuple[int, float]:
        """Return the lowest ISO that keeps the time short enough, and its time; else the highest."""
        if self.dials.steps == "free":
            iso = self._nearest_iso(self._longest_s, f_number)
            return iso, self._time_s(f_number, iso)
        isos, short_s = self._isos(), self._longest_s * 2.0**0.1667  # a sixth of a stop: the dial rounds it away
        found = next((iso for iso in isos if self._time_s(f_number, iso) <= short_s), None)
        if found is None:
            self.limits.append("highest ISO")
        iso = isos[-1] if found is None else found
        return iso, self._time_s(f_number, iso)

    def _aperture_for_time(self, time_s: float) -> Settings:
        """Choose the aperture and, where it does not open far enough, the ISO."""
        body, iso = self.body, self.start.iso
        missed: list[str] = []
        f_number = self.dials.f_number(body.f_number_for(self.wanted * body.white_e(iso) / time_s), body.widest, missed)
        if self.auto_iso is not None and missed == ["widest aperture"]:
            return Settings(time_s, f_number, self._nearest_iso(time_s, f_number))
        self.limits += missed
        return Settings(time_s, f_number, iso)

    def _programme(self) -> Settings:
        """Open the aperture until the time can be held by hand; from there on share the stops between both."""
        body, iso = self.body, self.start.iso
        spare = self._longest_s / self._time_s(body.widest, iso)
        f_number = body.widest
        if spare > 1.0:
            f_number = self.dials.f_number(
                body.f_number_for(body.solid_angle_sr(body.widest) / math.sqrt(spare)), body.widest, []
            )
            if self._time_s(f_number, iso) < self.dials.shortest_s:
                needed_sr = self.wanted * body.white_e(iso) / self.dials.shortest_s
                f_number = self.dials.f_number(body.f_number_for(needed_sr), body.widest, self.limits)
        chosen = self._time_for_aperture(f_number)
        if "longest time" in self.limits:
            self.limits.append("widest aperture")
        return chosen
