"""The light of a shot over time: which lamps there are, and how much of each lamp's light every line of the sensor collects."""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from simulator.color.reproducible import nine_digits_each
from simulator.exposure.flash import Flash, add_flash
from simulator.exposure.light_curve import LightCurve, SteadyLight, collect
from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.exposure.settings import Exposure
from simulator.scene.content_keys import freeze
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window

LEAST = 1e-6  # of the light: less than the rounding of the passes before it
MISSED = "fires while no line is open"  # of a flash


@dataclass(frozen=True)
class LightComponent:
    """Light of one kind of lamp on the scene, and when the lines of the sensor collect it.

    Its image is that of the scene's bands which it lights (`OpticsPlan.lit_by`). What a line collects of it is
    the integral of opening times light over the clock, over the nominal exposure time.

    is_flash: whether it is the flash, whose bands are the second half of the scene's; else the steady or flickering light.
    curve: its light over the clock. openings: of the shutter, which add up. release_s: of the shutter, on the clock.
    time_s: nominal exposure time, by which all is divided.
    """

    is_flash: bool
    curve: LightCurve
    openings: tuple[LineTimes, ...]
    release_s: float
    time_s: float

    def collected(self, until_s: np.ndarray | None = None) -> np.ndarray:
        """Return what each line collects, relative to steady light through a fully open shutter, float64.

        (lines,), or up to some instants of the clock (lines, instants); of a flash per second [1/s]. The difference of two
        instants is the weight of the interval between them in a moving scene's exposure. until_s: as `collect` takes it.
        """
        parts = [collect(self.curve, lines, self.release_s, until_s) for lines in self.openings]
        return np.sum(parts, axis=0) / self.time_s

    @cached_property
    def most(self) -> float:
        """What the line with most light collects, by which the scene's spectra are multiplied; 1 where that is 1 in float32."""
        most = float(self.collected().max())
        if most * (self.time_s if self.is_flash else 1.0) < LEAST:
            return 0.0
        return 1.0 if np.float32(most) == 1.0 and not self.is_flash else most

    @cached_property
    def shares(self) -> np.ndarray:
        """What each line collects relative to the line with most, (lines,) float32; 1 where all are within LEAST of it."""
        shares = self.collected() / self.most if self.most > 0.0 else np.ones(len(self.openings[0].peak))
        if shares.min() > 1.0 - LEAST:
            return np.ones(len(shares), np.float32)
        return np.clip(shares, 0.0, 1.0).astype(np.float32)

    def lit_openings(self) -> tuple[LineTimes, ...]:
        """Return the openings limited to the time in which there is light, such as that of a flash, from the release on.

        A line whose shutter opens or closes while the light begins or ends keeps its own: a part of a ramp is no trapezoid.
        """
        begin, end = (instant - self.release_s for instant in self.curve.span_s)
        limited = []
        for lines in self.openings:
            whole = np.array([lines.opens_s, lines.open_s, lines.closes_s, lines.closed_s])
            ramps = (whole[0], whole[1]), (whole[2], whole[3])
            is_cut = np.any([_lies_inside(edge, *ramp) for ramp in ramps for edge in (begin, end)], axis=0)
            edges = np.where(is_cut, whole, np.clip(whole, begin, end))
            limited.append(LineTimes(lines.axis, edges[0], edges[1], edges[2], edges[3], lines.peak))
        return tuple(limited)

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last instant of the clock at which any line may collect its light [s]."""
        first = self.release_s + min(float(lines.opens_s.min()) for lines in self.openings)
        last = self.release_s + max(float(lines.closed_s.max()) for lines in self.openings)
        begin, end = self.curve.span_s
        return max(first, begin), max(min(last, end), max(first, begin))


@dataclass(frozen=True)
class ExposedLight:
    """All light of a shot, and the shares of it that lines collect.

    components: the scene's own light first, then the flash, unless no line is open while it fires.
    axis: what a line is, see `LineTimes`. shutter_text, flicker_text, flash_text: numbers for the plan; None: there is none.
    flash: the flash that lights the scene.
    """

    components: tuple[LightComponent, ...]
    axis: Literal["rows", "columns", "all"]
    shutter_text: str
    flicker_text: str | None = None
    flash_text: str | None = None
    flash: Flash | None = None

    @property
    def openings(self) -> tuple[LineTimes, ...]:
        """When the lines of the sensor are open, from the release on."""
        return self.components[0].openings

    @property
    def is_plain(self) -> bool:
        """Whether all lines collect the scene's own light alone, for the nominal time."""
        only = self.components[0]
        return len(self.components) == 1 and only.most == 1.0 and not self.varies

    @property
    def varies(self) -> bool:
        """Whether lines collect different shares of any component."""
        return any(bool((one.shares != 1.0).any()) for one in self.components)

    @property
    def is_split(self) -> bool:
        """Whether the components need an image each, since lines collect different shares of them; else their bands add up."""
        return any(not np.array_equal(one.shares, self.components[0].shares) for one in self.components[1:])

    def missed_flash(self) -> str | None:
        """Return a warning of a flash that lights no line; None without."""
        has_missed = self.flash is None and self.flash_text is not None
        return f"exposure.flash: it {MISSED}; change its sync or delay, or the exposure time" if has_missed else None

    def even_text(self) -> str:
        """Return why no line needs a share of its own."""
        return "all lines are open at the same time" if self.axis == "all" else "all lines collect as much light"

    def window_shares(self, component: LightComponent, window: Window) -> np.ndarray:
        """Return the shares of the lines of a window, or the one of all lines, (lines,) float32."""
        if self.axis == "all":
            return component.shares
        first, count = (window.y, window.height) if self.axis == "rows" else (window.x, window.width)
        return component.shares[first : first + count]

    def describe_lines(self, window: Window) -> dict[str, object]:
        """Return when the lines of a window are open, plain data for the JSON beside a raw file.

        release_s: of the shutter, on the clock. lines: rows, columns, or all at once; first_line: the first of the window.
        start_s: of the first line, from the release on, and step_s from line to line; where lines do not follow each other
        evenly, start_s is a list. duration_s: for which a line is open, a list where lines differ. Both are those of an equal
        box: ramps count half.
        """
        own = self.components[0]
        times = own.openings[0]
        start, duration = 0.5 * (times.opens_s + times.open_s), times.effective_s
        if self.axis == "all":
            only = {"start_s": float(start[0]), "step_s": 0.0, "duration_s": float(duration[0])}
            return {"release_s": own.release_s, "lines": "all", **only}
        first, count = (window.y, window.height) if self.axis == "rows" else (window.x, window.width)
        start, duration = start[first : first + count], duration[first : first + count]
        step = float(start[-1] - start[0]) / max(count - 1, 1)
        close = 1e-9 * (own.time_s + float(np.ptp(start)))
        is_even = bool((np.abs(start - (start[0] + step * np.arange(count))) <= close).all())
        even = {"start_s": float(start[0]), "step_s": step} if is_even else {"start_s": nine_digits_each(start).tolist()}
        same = bool((np.abs(duration - duration[0]) <= close).all())
        lengths = own.time_s if same and abs(duration[0] - own.time_s) <= close else duration[0] if same else None
        each = {"duration_s": nine_digits_each(duration).tolist() if lengths is None else float(lengths)}
        return {"release_s": own.release_s, "lines": self.axis, "first_line": first, **even, **each}

    def key(self, tangent_per_px: float) -> Hashable:
        """Return what the light on the sensor depends on; None where it is that of a plain exposure."""
        if self.is_plain:
            return None
        flash = None if self.flash is None else (freeze(self.flash), tangent_per_px)
        return self.axis, flash, tuple((one.is_flash, one.most, one.shares.tobytes()) for one in self.components)

    def expose(self, scene: Scene, tangent_per_px: float) -> Scene:
        """Return the scene whose steady radiance gives as much light within the nominal time, at the line with most of it.

        With a flash it has as many bands more, see `add_flash`, which tells tangent_per_px. Raises PhotositeError as that does.
        """
        if self.is_plain:
            return scene
        return scene.remember(("exposed", self.key(tangent_per_px)), lambda: self._expose(scene, tangent_per_px))

    def _expose(self, scene: Scene, tangent_per_px: float) -> Scene:
        bands = scene.planes.shape[2]
        if self.flash is not None:
            scene = add_flash(scene, self.flash, tangent_per_px)
        factors = np.repeat([one.most for one in self.components], bands)
        return replace(scene, spectra_w_m2_sr_nm=scene.spectra_w_m2_sr_nm * factors[:, None])

    def bands(self, component: LightComponent, count: int) -> slice:
        """Return the bands that a component lights, of as many as the exposed scene has."""
        if len(self.components) == 1:
            return slice(0, count)
        return slice(count // 2, count) if component.is_flash else slice(0, count // 2)


def _lies_inside(time_s: float, begin_s: np.ndarray, end_s: np.ndarray) -> np.ndarray:
    """Return whether a time lies within intervals and not at their ends, (lines,)."""
    near_s = LEAST * (end_s - begin_s)
    return (begin_s + near_s < time_s) & (time_s < end_s - near_s)


def plan_exposure(exposure: Exposure, camera: Camera, f_number: float, working_f_number: float) -> ExposedLight:
    """Return the light of a shot over time.

    f_number, working_f_number: of the lens's aperture, and of the cone of light at the sensor. Raises PhotositeError for a
    shutter that the camera, the lens or the time cannot have.
    """
    time_s, release_s, shutter = exposure.time_s, exposure.start_s, exposure.shutter
    openings: tuple[LineTimes, ...]
    openings, text = (open_at_once(time_s),), "global: all lines are open at the same time"
    if shutter is not None:
        openings = shutter.line_times(camera, time_s, f_number, working_f_number)
        text = shutter.describe(camera, time_s, f_number, working_f_number)
    flicker, flash = exposure.flicker, exposure.flash
    own: LightCurve = SteadyLight() if flicker is None else flicker
    components = [LightComponent(False, own, openings, release_s, time_s)]
    flash_text = None
    if flash is not None:
        fired = LightComponent(True, flash.pulse(openings[0], release_s), openings, release_s, time_s)
        flash_text = flash.describe()
        if fired.most > 0.0:
            components.append(fired)
        else:
            flash, flash_text = None, f"{flash_text}: {MISSED}"
    flicker_text = None if flicker is None else flicker.describe()
    return ExposedLight(tuple(components), openings[0].axis, text, flicker_text, flash_text, flash)
