"""Shutters: when light reaches each line of the sensor, for a camera, an f-number and a time.

Each kind gives `LineTimes` of the whole sensor, so that a window of it has the times of its rows in the whole frame.
"""

import math
from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.sensor.camera.camera import Camera
from simulator.units import FNumber, MetresPerSecondSquared, Millimetres, Seconds

Travel = Literal["top_to_bottom", "bottom_to_top", "left_to_right", "right_to_left"]
ScanOrder = Literal["top_to_bottom", "bottom_to_top", "left_to_right", "right_to_left", "none"]
KEY = "exposure.shutter"


class Shutter(Protocol):
    """A kind of shutter. Its docstring begins with its name, for the plan."""

    def line_times(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> tuple[LineTimes, ...]:
        """Return when each line of the sensor gets light, from the release on: one trapezoid, or several that add up.

        time_s: nominal exposure time. f_number: of the lens's aperture. working_f_number: of the cone of light at the sensor.
        Raises PhotositeError for a camera, lens or time that the shutter cannot have.
        """
        ...

    def describe(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> str:
        """Return its numbers at this camera, time and lens, for the plan."""
        ...


@dataclass(frozen=True)
class GlobalShutter:
    """All lines are open at the same time; what their storage nodes still gather until they are read is a ghost.

    parasitic_light: parasitic light sensitivity (PLS), 0 to 1: of the light that falls on a line after the exposure, the share
        that is added until the line is read; shutter efficiency is 1 - PLS. The ghost grows linearly with the line's wait.
    readout_time_s: from the read-out of the first line to that of one past the last; left out: the camera's.
    scan_order: in which order lines are read.
    """

    parasitic_light: float
    readout_time_s: Seconds | None = None
    scan_order: ScanOrder = "top_to_bottom"

    def __post_init__(self) -> None:
        share = self.parasitic_light
        require(0 <= share < 1, f"{KEY}.parasitic_light", share, "give a share from 0 to below 1, such as 0.00013")
        _check_readout_time(self.readout_time_s)
        _check_word(self.scan_order, ScanOrder, "scan_order")

    def line_times(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> tuple[LineTimes, ...]:
        """Return the exposure and the ghost, which each line gathers from its end until the line is read."""
        if self.parasitic_light == 0 or self.scan_order == "none":
            return (open_at_once(time_s),)
        axis, before = _scanned_lines(camera, self.scan_order)
        start, end = np.zeros_like(before), np.full_like(before, time_s)
        read = end + before * (_readout_time_s(self.readout_time_s, camera) / len(before))
        ghost = LineTimes(axis, end, end, read, read, np.full_like(before, self.parasitic_light))
        return LineTimes(axis, start, start, end, end, np.ones_like(before)), ghost

    def describe(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> str:
        """Return the share of the light that leaks in."""
        return f"global, ghost of {self.parasitic_light:g} of the light until each line is read"


@dataclass(frozen=True)
class RollingShutter:
    """Electronic rolling shutter: lines are reset, and after the exposure time read, one after the other.

    readout_time_s: from the start of the first line to that of one past the last; left out: the camera's `readout_time`.
    scan_order: in which order; none: all lines at once.
    """

    readout_time_s: Seconds | None = None
    scan_order: ScanOrder = "top_to_bottom"

    def __post_init__(self) -> None:
        _check_readout_time(self.readout_time_s)
        _check_word(self.scan_order, ScanOrder, "scan_order")

    def line_times(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> tuple[LineTimes, ...]:
        """Return line i open from i T_read / lines on, for the exposure time."""
        if self.scan_order == "none":
            return (open_at_once(time_s),)
        axis, before = _scanned_lines(camera, self.scan_order)
        start = before * (_readout_time_s(self.readout_time_s, camera) / len(before))
        end = start + time_s
        return (LineTimes(axis, start, start, end, end, np.ones_like(start)),)

    def describe(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> str:
        """Return the read-out time of the sensor and of a line."""
        if self.scan_order == "none":
            return "electronic, all lines at once"
        readout_s = _readout_time_s(self.readout_time_s, camera)
        lines = len(_scanned_lines(camera, self.scan_order)[1])
        way = self.scan_order.replace("_", " ")
        return f"rolling, {way} in {1e3 * readout_s:.4g} ms, {1e6 * readout_s / lines:.4g} us a line"


@dataclass(frozen=True)
class CurtainShutter:
    """Focal-plane curtains: a slit crosses the sensor; the second curtain follows the first after the exposure time.

    travel_time_s: in which a curtain crosses the sensor.
    acceleration_m_per_s2: of the curtains, constant; with the travel time it gives their speed, below 0 they are slowed down.
    distance_mm: of the curtains from the sensor. The cone of light that a photosite sees, distance / N wide there, softens the
        edges of the slit: of the time that a line sees any light it is fully open for a share. A slit of width a has the
        efficiency a / (a + distance / N), and gives the exposure time whatever its width (Ives, Airplane Photography, 1920).
    travel: direction, in the picture.
    """

    travel_time_s: Seconds
    acceleration_m_per_s2: MetresPerSecondSquared = 0.0
    distance_mm: Millimetres = 0.0
    travel: Travel = "top_to_bottom"

    def __post_init__(self) -> None:
        _check_curtain(self.travel_time_s, self.acceleration_m_per_s2, self.distance_mm)
        _check_word(self.travel, Travel, "travel")

    def line_times(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> tuple[LineTimes, ...]:
        """Return for each line the box of the exposure time, smoothed by the box in which an edge crosses the cone of light."""
        axis, crossing_s, edge_s = _curtain_edges(
            camera, self.travel, self.travel_time_s, self.acceleration_m_per_s2, self.distance_mm, working_f_number
        )
        opens = crossing_s - 0.5 * edge_s
        opens -= opens.min()  # the shutter is released when the first light gets in
        short, long = np.minimum(time_s, edge_s), np.maximum(time_s, edge_s)
        peak = time_s / long
        return (LineTimes(axis, opens, opens + short, opens + long, opens + long + short, peak),)

    def describe(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> str:
        """Return width of the slit and efficiency in the middle of the frame."""
        width_mm = _width_mm(camera, self.travel)
        if self.travel_time_s == 0:
            return "curtains, all lines at once"
        slit_mm = width_mm / self.travel_time_s * time_s  # the speed in the middle is near the mean
        cone_mm = self.distance_mm / working_f_number if self.distance_mm else 0.0
        slit = f"a slit of {slit_mm:.3g} mm" if slit_mm < width_mm else "fully open in between"
        return (
            f"curtains, {self.travel.replace('_', ' ')} in {1e3 * self.travel_time_s:.4g} ms, {slit}, "
            f"efficiency {slit_mm / (slit_mm + cone_mm):.3g}"
        )


@dataclass(frozen=True)
class FirstCurtainShutter:
    """Electronic first curtain: lines are reset one after the other, and a mechanical curtain ends their exposure.

    reset_time_s: in which the reset crosses the sensor, at even speed unless reset_acceleration says otherwise.
    travel_time_s: in which the curtain crosses it. The exposure time is that of the middle of the frame.
    acceleration_m_per_s2, distance_mm: of the curtain, as those of `CurtainShutter`.
    reset_acceleration_m_per_s2: of the reset; that of the curtain where the camera makes up for it.
    travel: direction, in the picture.
    """

    reset_time_s: Seconds
    travel_time_s: Seconds
    reset_acceleration_m_per_s2: MetresPerSecondSquared = 0.0
    acceleration_m_per_s2: MetresPerSecondSquared = 0.0
    distance_mm: Millimetres = 0.0
    travel: Travel = "top_to_bottom"

    def __post_init__(self) -> None:
        _check_curtain(self.reset_time_s, self.reset_acceleration_m_per_s2, 0.0, "reset_time", "reset_acceleration")
        _check_curtain(self.travel_time_s, self.acceleration_m_per_s2, self.distance_mm)
        _check_word(self.travel, Travel, "travel")

    def line_times(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> tuple[LineTimes, ...]:
        """Return each line open from its reset until the curtain's edge has crossed the cone of light.

        Raises PhotositeError where the curtain is before the reset, so that a line would get no light at all.
        """
        axis, reset_s, _ = _curtain_edges(
            camera, self.travel, self.reset_time_s, self.reset_acceleration_m_per_s2, 0.0, 1.0, key="reset_acceleration"
        )
        _, crossing_s, edge_s = _curtain_edges(
            camera, self.travel, self.travel_time_s, self.acceleration_m_per_s2, self.distance_mm, working_f_number
        )
        delay_s = time_s + self._middle_s(camera, is_reset=True) - self._middle_s(camera, is_reset=False)
        closes, closed = crossing_s + delay_s - 0.5 * edge_s, crossing_s + delay_s + 0.5 * edge_s
        if not bool((closed > reset_s).all()):
            line = int(np.argmin(closed - reset_s))
            late_s = float((reset_s - closed)[line])
            raise PhotositeError(
                f"the second curtain passes line {line} {late_s:.3g} s before that line is reset, so it would get no light; "
                f"give at least {1.01 * (time_s + late_s):.3g} s, or a shutter whose curtain is as slow as its reset",
                key="exposure.time",
                value=f"{time_s:g} s",
            )
        late = np.maximum(closes, reset_s)  # a reset within the curtain's soft edge
        with np.errstate(invalid="ignore", divide="ignore"):
            peak = np.where(closes >= reset_s, 1.0, (closed - reset_s) / edge_s)
        return (LineTimes(axis, reset_s, reset_s, late, closed, peak),)

    def _middle_s(self, camera: Camera, is_reset: bool) -> float:
        """Return the time in which the reset or the curtain comes to the middle of the frame [s]."""
        time_s = self.reset_time_s if is_reset else self.travel_time_s
        acceleration = self.reset_acceleration_m_per_s2 if is_reset else self.acceleration_m_per_s2
        width_mm = _width_mm(camera, self.travel)
        return float(_crossing(np.array([0.5 * width_mm]), width_mm, time_s, acceleration)[0][0])

    def describe(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> str:
        """Return the times of both, and those of the first and the last line."""
        lines = self.line_times(camera, time_s, f_number, working_f_number)[0].effective_s
        first, last = (lines[0], lines[-1]) if self.travel in ("top_to_bottom", "left_to_right") else (lines[-1], lines[0])
        return (
            f"electronic first curtain in {1e3 * self.reset_time_s:.4g} ms, second in {1e3 * self.travel_time_s:.4g} ms; "
            f"the first line is open for {first:.4g} s, the last for {last:.4g} s"
        )


@dataclass(frozen=True)
class LeafShutter:
    """Blades in the lens that uncover the aperture from its middle on, at an even pace of area.

    The exposure time begins with the opening and ends with the closing: the effective time is shorter by half of both.
    opening_s, closing_s: in which the blades uncover and cover the aperture. Where the exposure time is shorter than both, they
        turn back on the way and never open fully.
    widest_f_number: aperture that they uncover in these times; a smaller one, whose area is (widest / N)^2 of it, is open
        earlier and longer. Left out: that of the lens.
    """

    opening_s: Seconds
    closing_s: Seconds
    widest_f_number: FNumber | None = None

    def __post_init__(self) -> None:
        for key, time_s in (("opening", self.opening_s), ("closing", self.closing_s)):
            require(0 <= time_s < math.inf, f"{KEY}.{key}", f"{time_s:g} s", "give a time of 0 s or more, such as 1 ms")
        widest = self.widest_f_number
        require(widest is None or 0 < widest < math.inf, f"{KEY}.widest_f_number", widest, "give an f-number such as f/2.8")

    def line_times(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> tuple[LineTimes, ...]:
        """Return the one trapezoid of the whole sensor."""
        pupil = self._pupil_share(f_number)
        both_s = self.opening_s + self.closing_s
        uncovered = min(pupil, time_s / both_s if both_s > 0 else 1.0)
        times = 0.0, uncovered * self.opening_s, time_s - uncovered * self.closing_s, time_s
        opens, open_, closes, closed = (np.array([one]) for one in times)
        return (LineTimes("all", opens, open_, np.maximum(open_, closes), closed, np.array([uncovered / pupil])),)

    def _pupil_share(self, f_number: float) -> float:
        """Return area of the aperture relative to that of the widest. Raises PhotositeError for a wider one."""
        if self.widest_f_number is None:
            return 1.0
        rule = "needs a lens with an aperture no wider; leave widest_f_number out, or give that of the lens"
        good = f_number >= self.widest_f_number * (1.0 - 1e-9)  # not so for NaN, of a sensor without a lens
        require(good, f"{KEY}.widest_f_number", f"f/{self.widest_f_number:g}", rule)
        return min(1.0, (self.widest_f_number / f_number) ** 2)

    def describe(self, camera: Camera, time_s: float, f_number: float, working_f_number: float) -> str:
        """Return the effective time and the efficiency."""
        effective_s = float(self.line_times(camera, time_s, f_number, working_f_number)[0].effective_s[0])
        return f"leaf, open for an effective {effective_s:.4g} s of {time_s:.4g} s, efficiency {effective_s / time_s:.3g}"


AnyShutter = CurtainShutter | RollingShutter | FirstCurtainShutter | LeafShutter | GlobalShutter


def _check_readout_time(time_s: float | None) -> None:
    if time_s is not None:
        good = 0 <= time_s < math.inf
        require(good, f"{KEY}.readout_time", f"{time_s:g} s", "give a time of 0 s or more, such as 20 ms")


def _check_word(word: str, words: object, key: str) -> None:
    known = get_args(words)
    require(word in known, f"{KEY}.{key}", word, f"give one of {', '.join(known)}")


def _check_curtain(
    time_s: float, acceleration: float, distance_mm: float, time_key: str = "travel_time", key: str = "acceleration"
) -> None:
    require(0 <= time_s < math.inf, f"{KEY}.{time_key}", f"{time_s:g} s", "give a time of 0 s or more, such as 3 ms")
    require(math.isfinite(acceleration), f"{KEY}.{key}", f"{acceleration:g} m/s^2", "give a finite acceleration")
    good = 0 <= distance_mm < math.inf
    require(good, f"{KEY}.distance", f"{distance_mm:g} mm", "give a distance of 0 mm or more, such as 2 mm")


def _readout_time_s(own_s: float | None, camera: Camera) -> float:
    """Return the read-out time, the shutter's or the camera's [s]. Raises PhotositeError where neither states one."""
    time_s = camera.readout_time_s if own_s is None else own_s
    if time_s is None:
        rule = (
            f"{camera.make} {camera.model} states none; give the time from the first line to one past the last, such as 20 ms"
        )
        raise PhotositeError(rule, key=f"{KEY}.readout_time", value="none")
    return time_s


def _scanned_lines(camera: Camera, order: ScanOrder) -> tuple[Literal["rows", "columns"], np.ndarray]:
    """Return which lines are scanned, and for each, by its place on the sensor, how many come before it, (lines,) float64."""
    is_rows = order in ("top_to_bottom", "bottom_to_top")
    before = np.arange(camera.height_px if is_rows else camera.width_px, dtype=np.float64)
    return ("rows" if is_rows else "columns"), before if order in ("top_to_bottom", "left_to_right") else before[::-1].copy()


def _width_mm(camera: Camera, travel: Travel) -> float:
    """Return the side of the sensor along which curtains travel [mm]."""
    width_mm, height_mm = camera.sensor_mm
    return height_mm if travel in ("top_to_bottom", "bottom_to_top") else width_mm


def _crossing(
    place_mm: np.ndarray, width_mm: float, travel_time_s: float, acceleration_m_per_s2: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return when an edge comes to these places [s] and its speed there [mm/s].

    y = v0 t + a t^2 / 2 with y(travel time) = width, so v0 = width / T - a T / 2.
    """
    if travel_time_s == 0:
        return np.zeros_like(place_mm), np.full_like(place_mm, np.inf)
    acceleration = 1e3 * acceleration_m_per_s2
    first = width_mm / travel_time_s - 0.5 * acceleration * travel_time_s
    speed = np.sqrt(np.maximum(first**2 + 2.0 * acceleration * place_mm, 0.0))
    return 2.0 * place_mm / (first + speed), speed


def _curtain_edges(
    camera: Camera,
    travel: Travel,
    travel_time_s: float,
    acceleration_m_per_s2: float,
    distance_mm: float,
    working_f_number: float,
    key: str = "acceleration",
) -> tuple[Literal["rows", "columns"], np.ndarray, np.ndarray]:
    """Return which lines a curtain crosses, when its edge is at each [s], and how long it takes through the cone of light [s].

    Raises PhotositeError for an acceleration with which the curtain would stand still or turn back on the sensor, and for a
    curtain before the sensor where there is no cone of light.
    """
    width_mm = _width_mm(camera, travel)
    if travel_time_s > 0:
        most = 2e-3 * width_mm / travel_time_s**2
        rule = f"a curtain that crosses {width_mm:.4g} mm in {travel_time_s:.3g} s starts or ends at rest with {most:.4g} m/s^2"
        rule += "; give less, or a shorter travel_time"
        value = f"{acceleration_m_per_s2:g} m/s^2"
        require(abs(acceleration_m_per_s2) <= most, f"{KEY}.{key}", value, rule)
    if distance_mm > 0:
        rule = "its shadow depends on the f-number, and without a lens there is none; leave it out"
        require(math.isfinite(working_f_number), f"{KEY}.distance", f"{distance_mm:g} mm", rule)
    axis, before = _scanned_lines(camera, travel)
    crossing_s, speed = _crossing((before + 0.5) * 1e-3 * camera.pixel_pitch_um, width_mm, travel_time_s, acceleration_m_per_s2)
    edge_s = np.zeros_like(speed) if distance_mm == 0 else distance_mm / working_f_number / speed
    return axis, crossing_s, edge_s
