"""Simulation of the frames that a shutter validation needs (`photosite validate shutter`), as DNG files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.flash import INCIDENT_LX_S, Flash
from simulator.exposure.flicker import MainsFlicker
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import AnyShutter, CurtainShutter, FirstCurtainShutter, GlobalShutter, RollingShutter
from simulator.measurement.noise_check.expected import CLEAR_SIGMAS, is_pedestal_sufficient
from simulator.measurement.noise_check.flat_bench import FlatBench, UniformLight, white_light
from simulator.measurement.shutter_check.scan import Scan
from simulator.pipeline.shot import SceneSource
from simulator.pipeline.simulate import simulate
from simulator.progress import Steps
from simulator.raw.dng.writer import write_dng
from simulator.scene.charts import ChartScene
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera, Window

STRIP_PX = 128  # width of the frames across the scan
MOTION_TOLERANCE = 0.01  # of frames in which something moves [standard deviations of the noise]
FLASH_DISTANCE_M = 2.0
DARK_CD_M2 = 1e-6  # of the scene in frames that a flash lights


@dataclass(frozen=True)
class EdgeScene:
    """Half of the field in light, half dark; the edge runs through the middle.

    A photosite sees the pixel in its centre, so that it adds nothing to the edge's blur.
    light: of the bright half. by_columns: the upper half is bright, else the left one.
    """

    light: UniformLight
    by_columns: bool

    def load(self) -> Scene:
        """Make the scene, of 2 x 2 pixels."""
        bright = np.array([[1.0, 1.0], [0.0, 0.0]] if self.by_columns else [[1.0, 0.0], [1.0, 0.0]])
        return replace(self.light.load(), planes=bright[..., None].astype(np.float32))


@dataclass(frozen=True)
class Frame:
    """A frame to take.

    share: of saturation that the light brings to the most sensitive colour within the nominal time; 0: dark.
    light_time_s: nominal time for which that share is meant; left out: that of the exposure.
    scene: left out: uniform light. motion: of what moves; left out: nothing.
    middle: number of lines of the frame, in the middle of the sensor; left out: all.
    """

    name: str
    exposure: Exposure
    share: float = 0.0
    light_time_s: float | None = None
    scene: SceneSource | None = None
    motion: Motion | None = None
    middle: int | None = None


@dataclass(frozen=True)
class TakenFrame:
    """Raw files of one frame, and of a dark frame of the same exposure time."""

    path: Path
    dark: Path


@dataclass(frozen=True)
class ShutterBench:
    """Takes frames of one shutter at one ISO, on a strip of the sensor along the scan that has all its lines.

    The light passes an f/4 lens without cos^4 falloff, so that the mean number of photons is the same for every photosite.
    middle: number of lines, where frames have the middle ones alone.
    """

    camera: Camera
    shutter: AnyShutter
    iso: int
    folder: Path
    device: str | None = None
    middle: int | None = None

    @cached_property
    def scan(self) -> Scan | None:
        """How the shutter opens one line after the other for the exposure time; None where it does not.

        Raises PhotositeError for a rolling shutter whose read-out time nobody states.
        """
        shutter = self.shutter
        if isinstance(shutter, CurtainShutter):
            time_s = shutter.travel_time_s
            return Scan(time_s, self.bend_of(shutter.acceleration_m_per_s2, time_s)) if time_s > 0 else None
        if not isinstance(shutter, RollingShutter) or shutter.scan_order == "none":
            return None
        return Scan(self.readout_s) if self.readout_s > 0 else None

    @property
    def readout_s(self) -> float:
        """Read-out time of an electronic shutter [s]; the camera's where it states none.

        Raises PhotositeError where neither does.
        """
        own_s = self.shutter.readout_time_s if isinstance(self.shutter, RollingShutter | GlobalShutter) else None
        stated_s = self.camera.readout_time_s if own_s is None else own_s
        if stated_s is None:
            name = f"{self.camera.make} {self.camera.model}"
            rule = f"{name} states none; give one with --readout-time, such as 20 ms, or another shutter with --shutter"
            raise PhotositeError(rule, key="camera.readout_time", value="none")
        return stated_s

    @property
    def cone(self) -> float:
        """Width of the cone of light at the curtains, as share of their way; 0 for others than curtains."""
        return self.shutter.distance_mm / self.f_number / self.way_mm if isinstance(self.shutter, CurtainShutter) else 0.0

    @property
    def order(self) -> str:
        """Direction in which the shutter goes through the lines; rows from the top where it opens all at once."""
        shutter = self.shutter
        if isinstance(shutter, RollingShutter | GlobalShutter) and shutter.scan_order != "none":
            return shutter.scan_order
        return shutter.travel if isinstance(shutter, CurtainShutter | FirstCurtainShutter) else "top_to_bottom"

    @property
    def by_columns(self) -> bool:
        """Whether lines are columns."""
        return self.order in ("left_to_right", "right_to_left")

    @property
    def is_reversed(self) -> bool:
        """Whether the last row or column comes first."""
        return self.order in ("bottom_to_top", "right_to_left")

    @property
    def across(self) -> int:
        """Photosites of a line of a frame."""
        return self.strip.frame.height if self.by_columns else self.strip.frame.width

    @property
    def distance_px(self) -> float:
        """From the lens to the sensor [photosites]."""
        lens = self.flat(1.0).shot(1.0, 0).lens
        return 1e3 * lens.image_distance_mm / self.camera.pixel_pitch_um

    @property
    def has_curtains(self) -> bool:
        """Whether a slit between two curtains crosses the sensor, which may be accelerated."""
        return isinstance(self.shutter, CurtainShutter)

    @property
    def way_mm(self) -> float:
        """Side of the sensor along which the shutter crosses it [mm]."""
        return self.camera.sensor_mm[0 if self.by_columns else 1]

    @property
    def reason_dark_is_clipped(self) -> str:
        """Why light beside darkness cannot be measured exactly, or an empty string."""
        is_clear = is_pedestal_sufficient(self.flat(1.0).sensor)
        return "" if is_clear else f"the pedestal is below {CLEAR_SIGMAS:g} standard deviations, so that files clip the dark"

    @property
    def reason_edge_is_soft(self) -> str:
        """Why an edge's profile is not that of its motion, or an empty string."""
        is_soft = self.camera.low_pass_um > 0 or self.camera.crosstalk is not None
        return "neighbouring photosites share the light of an edge" if is_soft else self.reason_dark_is_clipped

    def bend_of(self, acceleration_m_per_s2: float, time_s: float) -> float:
        """Return the share of the way that is made by an acceleration, for a crossing in this time; see `crossing_share`."""
        return 0.5e3 * acceleration_m_per_s2 * time_s**2 / self.way_mm

    @cached_property
    def strip(self) -> Camera:
        """The camera with a window of the middle of all lines of its active area, with the sensor's own filter pattern."""
        active = self.camera.active
        size = [min(STRIP_PX, active.width), min(self.middle or active.height, active.height)]
        if self.by_columns:
            size = [min(self.middle or active.width, active.width), min(STRIP_PX, active.height)]
        width, height = size
        x, y = active.x + (active.width - width) // 4 * 2, active.y + (active.height - height) // 4 * 2
        return replace(self.camera, window=Window(x, y, width, height))

    @property
    def lines(self) -> int:
        """Lines of the whole sensor."""
        return self.camera.width_px if self.by_columns else self.camera.height_px

    def line_places(self, count: int) -> np.ndarray:
        """Return where the lines of a frame lie on the way of the shutter, as it opens them, (lines,), 0 to 1."""
        first = self.strip.frame.x if self.by_columns else self.strip.frame.y
        place = (first + np.arange(count) + 0.5) / self.lines
        return 1.0 - place[::-1] if self.is_reversed else place

    @property
    def f_number(self) -> float:
        """Of the cone of light at the sensor, the lens being focused at infinity."""
        return self.flat(1.0).shot(1.0, 0).lens.f_number

    def describe(self) -> str:
        """Return the shutter in words, at 1/100 s."""
        return self.shutter.describe(self.camera, 0.01, self.f_number, self.f_number)

    def exposure(
        self, time_s: float, flicker: MainsFlicker | None = None, flash: Flash | None = None, start_s: float = 0.0
    ) -> Exposure:
        """Return an exposure through the shutter."""
        return Exposure(time_s, self.iso, start_s=start_s, shutter=self.shutter, flicker=flicker, flash=flash)

    def flat(self, time_s: float) -> FlatBench:
        """Return the bench with steady, uniform light for this nominal time."""
        return FlatBench(self.strip, self.iso, time_s, white_light(), self.folder, self.device)

    def flash_scene(self) -> ChartScene:
        """Return a white wall in the dark."""
        return ChartScene("flat_field", DARK_CD_M2, "D55", FLASH_DISTANCE_M)

    def guide_number_m(self, share: float) -> float:
        """Guide number of the flash that lights the wall so that it brings the most sensitive colour to a share of saturation.

        The wall's luminous exposure is H = C GN^2 / (100 r^2), C = 250, and its luminance times time H / pi.
        """
        cd_s_m2 = self.flat(1.0).factor_of(share)
        return FLASH_DISTANCE_M * math.sqrt(cd_s_m2 * math.pi * 100.0 / INCIDENT_LX_S)

    def flash(self, share: float, length_s: float, fires_s: float, time_s: float) -> Flash:
        """Return a flash that is fired so long after the release, for an exposure of this time."""
        lines = self.shutter.line_times(self.camera, time_s, self.f_number, self.f_number)[0]
        delay_s = fires_s - float(lines.open_s.max())
        return Flash(length_s, guide_number_m=self.guide_number_m(share), delay_s=delay_s)

    def take(self, frame: Frame, seed: int) -> Path:
        """Simulate a frame and save it as NAME.dng. Raises PhotositeError."""
        bench = replace(self, middle=frame.middle).flat(frame.light_time_s or frame.exposure.time_s)
        shot = bench.shot(bench.factor_of(frame.share), seed)
        shot = replace(shot, exposure=frame.exposure, motion=frame.motion)
        if isinstance(frame.scene, EdgeScene):
            shot = replace(shot, scene=replace(frame.scene, light=bench.light.scaled(bench.factor_of(frame.share))))
        elif frame.scene is not None:
            shot = replace(shot, scene=frame.scene)
        shot = replace(shot, tolerance=MOTION_TOLERANCE if frame.motion is not None else shot.tolerance)
        path = self.folder / f"{frame.name}.dng"
        write_dng(simulate(shot, device=self.device), path)
        return path


def dark_frames(frames: Sequence[Frame]) -> dict[tuple[float, int | None], Frame]:
    """Return the dark frames that these need, by exposure time [s] and number of lines."""
    kinds, iso = dict.fromkeys((frame.exposure.time_s, frame.middle) for frame in frames), frames[0].exposure.iso
    return {kind: Frame(f"dark_{index}", Exposure(kind[0], iso), middle=kind[1]) for index, kind in enumerate(kinds)}


def take_shutter_frames(
    bench: ShutterBench, frames: Sequence[Frame], first_seed: int, steps: Steps | None = None
) -> dict[str, TakenFrame]:
    """Simulate and save frames and their dark frames; by name. Seeds count up from the first. Raises PhotositeError."""
    seed = first_seed

    def take(frame: Frame) -> Path:
        nonlocal seed
        path = bench.take(frame, seed)
        seed += 1
        if steps is not None:
            steps.add(frame.name)
        return path

    darks = {kind: take(frame) for kind, frame in dark_frames(frames).items()}
    return {frame.name: TakenFrame(take(frame), darks[frame.exposure.time_s, frame.middle]) for frame in frames}
