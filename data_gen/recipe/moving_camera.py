"""A camera that moves while a sample's frames are taken: one path through rows, frames and the gaps between them."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.config.distributions import Distribution, LogUniform, draw, support_of
from simulator.config.random_streams import RandomStream
from simulator.errors import PhotositeError, require
from simulator.exposure.camera_table import Clip, MeasuredClip
from simulator.exposure.hand_tremor import HandTremor
from simulator.exposure.line_times import LineTimes
from simulator.exposure.mid_exposure import mid_exposure_s
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.units import Hertz

PATH_SEEDS = 2**53
STEP_S, MOST_STEPS = 2e-3, 4096  # of the search for how far a picture moves; 2 ms is a fortieth of a period of 12 Hz
BESIDE_PX = 2  # border beyond the farthest displacement, for reading between pixels
MOST_REACH_PX = 512


@dataclass(frozen=True)
class CameraMotion:
    """Camera that turns while a sample's frames are taken. Pictures have no depth, so it stays at its place.

    rms_deg_per_s: root mean square of the speed of rotation [deg/s], drawn for each sample.
    exposure_time_s: open time of the shutter [s], drawn for each sample.
    clips: measured clips of hand-held cameras, one drawn for each sample; none: a Gaussian random process of a stated spectrum.
    lowest_hz: lower end of the random process's band.
    highest_hz: upper end of it.
    focal_length_px: lens to sensor [photosites], drawn for each sample.
    gap_s: from the end of one frame's exposure to the release of the next [s], drawn for each sample.
    readout_time_s: rolling shutter: from the first row of the sensor to one past the last [s], drawn for each sample; 0: none.
    """

    rms_deg_per_s: Distribution = LogUniform((0.2, 5.0))
    exposure_time_s: Distribution = LogUniform((1e-3, 0.1))
    clips: tuple[Clip, ...] = ()
    lowest_hz: Hertz = 2.0
    highest_hz: Hertz = 12.0
    focal_length_px: Distribution = 3000.0
    gap_s: Distribution = 0.02
    readout_time_s: Distribution = 0.0

    def __post_init__(self) -> None:
        for name, least in (("exposure_time_s", "above 0"), ("focal_length_px", "above 0")):
            low = support_of(getattr(self, name))[0]
            require(low > 0, f"motion.{name.removesuffix('_px')}", f"from {low:g}", f"give numbers {least}")
        for name in ("rms_deg_per_s", "gap_s", "readout_time_s"):
            low = support_of(getattr(self, name))[0]
            require(low >= 0, f"motion.{name}", f"from {low:g}", "give numbers of 0 or above")
        HandTremor(1.0, self.lowest_hz, self.highest_hz)

    def draw(self, stream: RandomStream, frames: int) -> "MovingCamera":
        """Draw the camera of a sample of so many frames."""
        rms, exposure_s, focal_px, gap_s, readout_s = (
            draw(getattr(self, name), stream.uniform(f"motion {name}"))
            for name in ("rms_deg_per_s", "exposure_time_s", "focal_length_px", "gap_s", "readout_time_s")
        )
        seed = stream.integer("motion path", PATH_SEEDS)
        # The rows above the crop may be read before its own, and the clock begins with the first.
        starts_s = tuple(readout_s + frame * (exposure_s + gap_s) for frame in range(frames))
        if not self.clips:
            return MovingCamera(
                HandTremor(rms, self.lowest_hz, self.highest_hz, seed=seed), focal_px, exposure_s, readout_s, starts_s
            )
        clip = self.clips[stream.integer("motion clip", len(self.clips))]
        path = MeasuredClip(clip, seed, rms, starts_s[-1] + exposure_s + 2.0 * readout_s, metres_per_unit=0.0)
        return MovingCamera(path, focal_px, exposure_s, readout_s, starts_s)


@dataclass(frozen=True)
class MovingCamera:
    """The camera of a sample.

    path: of the camera; the picture is as its source has it when the clock is 0.
    focal_px: lens to sensor [photosites]. exposure_s: open time of each line [s]. readout_s: of the whole sensor [s].
    starts_s: release of each frame [s].
    """

    path: HandTremor | MeasuredClip
    focal_px: float
    exposure_s: float
    readout_s: float
    starts_s: tuple[float, ...]

    def image_motion(self, height: int, width: int) -> ImageMotion:
        """Return how a picture of this size moves, whose middle the optical axis meets [px]."""
        geometry = ImageGeometry(self.focal_px, width, height, 1.0, 0.5 * width, 0.5 * height)
        return ImageMotion(geometry, (Surface(math.inf, math.inf),), self.path)

    def line_times(self, first_row: int, rows: int, sensor_rows: int) -> LineTimes:
        """Return when rows of a sensor of so many rows are open, from the release on."""
        start = self.readout_s * (first_row + np.arange(rows)) / sensor_rows
        end = start + self.exposure_s
        return LineTimes("rows", start, start, end, end, np.ones(rows))

    def reach_px(self, height: int, width: int) -> int:
        """Return the border [px] that a picture needs around a crop of this size. Raises PhotositeError above 512 px."""
        lasts_s = self.starts_s[-1] + self.exposure_s + 2.0 * self.readout_s
        steps = min(max(math.ceil(lasts_s / STEP_S), 16), MOST_STEPS)
        motion = self.image_motion(height, width)
        moved = motion.displacements(motion.pose_numbers(np.linspace(0.0, lasts_s, steps + 1)))
        reach = 2 * math.ceil(0.5 * float(np.abs(moved).max())) + BESIDE_PX  # even, which keeps the phase of the colours
        if reach > MOST_REACH_PX:
            raise PhotositeError(
                f"the camera moves the picture by {reach} pixels within {lasts_s:.3g} s; give less speed, less time or a "
                "shorter focal length",
                key="motion.rms_deg_per_s",
                value=f"{self.path.rms_deg_per_s:g}",
            )
        return reach

    def middle_s(self, lines: LineTimes, frame: int) -> np.ndarray:
        """Return the middle of the exposure of each line of a frame on the clock, (lines,) [s]."""
        return self.starts_s[frame] + mid_exposure_s([lines])
