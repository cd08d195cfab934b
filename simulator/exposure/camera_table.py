"""Paths of the camera that were recorded: a user's table, and the clips of hand-held cameras in `configs/camera_paths`."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.color.color_tables import CONFIGS
from simulator.errors import require
from simulator.exposure.camera_motion import Poses, euler_angles, rotation_matrices
from simulator.exposure.path_table import PathTable, check_inside, read_path
from simulator.exposure.path_words import LARGEST_SEED, uniforms
from simulator.scene.length_units import METRES_PER_UNIT, LengthUnit
from simulator.units import DegreesPerSecond, Seconds

COLUMNS = tuple(f"{kind}_{axis}" for kind in ("location", "rotation_euler") for axis in "xyz")
CLIPS = CONFIGS / "camera_paths"
Clip = Literal[
    "bike_on_gravel_2d",
    "handycam_run",
    "investigation",
    "out_car_window",
    "spaceship_shake_2d",
    "the_closeup",
    "the_wedding",
    "the_zeek_2d",
    "walk_to_the_store",
]

LONGEST_CLIP, LONGEST_CLIP_S = "the_closeup (18 s)", 18.2


@dataclass(frozen=True)
class CameraTable:
    """Path of the camera in a CSV file with the columns time_s, location_x, _y, _z, rotation_euler_x, _y, _z (Blender's).

    Each coordinate, and each Euler angle (XYZ) after it is unwrapped, follows a cubic spline. Poses are relative to the one at
    clock 0, so that the axes of the file may lie in any way.
    unit: of the locations.
    angle: unit of the angles.
    start_s: time of the table when the clock is 0 [s]; left out: that of its first line.
    """

    path: Annotated[Path, "CSV with the columns time_s, location_x to _z, rotation_euler_x to _z; columns left out are 0"]
    unit: LengthUnit = "m"
    angle: Annotated[Literal["rad", "deg"], "unit of the angles"] = "rad"
    start_s: Seconds | None = None

    def __post_init__(self) -> None:
        finite = self.start_s is None or bool(np.isfinite(self.start_s))
        require(finite, "motion.camera.start", f"{self.start_s} s", "give a finite time of the table, such as 0.5 s")

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last time of the clock at which there is a pose [s]. Raises PhotositeError as `poses`."""
        table, start_s = self._table()
        return float(table.times_s[0] - start_s), float(table.times_s[-1] - start_s)

    @property
    def fastest_hz(self) -> float:
        """Highest frequency that the lines of the table hold [Hz]. Raises PhotositeError as `poses`."""
        return self._table()[0].highest_hz

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s].

        Raises PhotositeError for a file as `read_path` does, and for instants outside it.
        """
        _, location_m, turns = self._relative(times_s)
        return Poses(euler_angles(turns), location_m)

    def speeds(self, times_s: np.ndarray) -> Poses:
        """Return the derivatives of the poses at some instants (instants,) [s]. Raises PhotositeError as `poses`."""
        table, start_s = self._table()
        angles, _, turns = self._relative(times_s)
        rate = table.at(start_s + np.asarray(times_s), 1)
        to_rest = rotation_matrices(table.at(np.array([start_s]))[:, 3:])[0].T
        own, relative = _body_rates(angles), _body_rates(euler_angles(turns))
        return Poses(np.linalg.solve(relative, own @ rate[:, 3:, None])[..., 0], rate[:, :3] @ to_rest.T)

    def _relative(self, times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return angles in the file's axes (instants, 3), and location (instants, 3) [m] and rotation in those at clock 0."""
        table, start_s = self._table()
        check_inside(times_s, self.span_s, "motion.camera.path", self.path, "give a longer one or another start")
        values, rest = table.at(start_s + np.asarray(times_s, np.float64)), table.at(np.array([start_s]))
        to_rest = rotation_matrices(rest[:, 3:])[0].T
        return values[:, 3:], (values[:, :3] - rest[:, :3]) @ to_rest.T, to_rest @ rotation_matrices(values[:, 3:])

    def _table(self) -> tuple[PathTable, float]:
        """Return the table in metres and radians, and its time when the clock is 0 [s]."""
        stored = read_path(self.path, COLUMNS, "motion.camera.path")
        angles = stored.values[:, 3:] if self.angle == "rad" else np.radians(stored.values[:, 3:])
        values = np.hstack([METRES_PER_UNIT[self.unit] * stored.values[:, :3], np.unwrap(angles, axis=0)])
        start_s = float(stored.times_s[0]) if self.start_s is None else self.start_s
        first, last = stored.times_s[0], stored.times_s[-1]
        rule = f"the table {self.path} has times from {first:g} s to {last:g} s; give one of them"
        require(bool(first <= start_s <= last), "motion.camera.start", f"{start_s:g} s", rule)
        return PathTable(stored.times_s, values), start_s


@dataclass(frozen=True)
class MeasuredClip:
    """Tracked motion of a hand-held camera (camera_shakify by EatTheFuture, CC0 1.0; 24 samples a second, none above 12 Hz).

    seed: chooses where in the clip the clock is 0.
    rms_deg_per_s: root mean square of the speed of rotation, all three axes together, over the clip [deg/s]; rotation and
        location are scaled to it. Left out: as measured.
    length_s: how long the path holds at least from clock 0 on [s].
    metres_per_unit: of the tracker's unit of length, which is about 1 m; 0 leaves out that the camera changes its place.
    """

    clip: Clip
    seed: int = 0
    rms_deg_per_s: DegreesPerSecond | None = None
    length_s: Seconds = 1.0
    metres_per_unit: float = 1.0

    def __post_init__(self) -> None:
        rms = self.rms_deg_per_s
        require(rms is None or 0 <= rms < np.inf, "motion.camera.rms", f"{rms} deg/s", "give 0 or more, such as 2 deg/s")
        require(0 <= self.seed <= LARGEST_SEED, "motion.camera.seed", self.seed, "give 0 to 2^64 - 1")
        require(0 <= self.length_s < np.inf, "motion.camera.length", f"{self.length_s} s", "give 0 s or more, such as 1 s")
        scale = self.metres_per_unit
        require(0 <= scale < np.inf, "motion.camera.metres_per_unit", scale, "give 0 or more, such as 1")

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last time of the clock at which there is a pose [s]. Raises PhotositeError as `poses`."""
        table, start_s = self._table()
        return float(table.times_s[0] - start_s), float(table.times_s[-1] - start_s)

    @property
    def fastest_hz(self) -> float:
        """Highest frequency that the lines of the table hold [Hz]. Raises PhotositeError as `poses`."""
        return self._table()[0].highest_hz

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s]. Raises PhotositeError outside the clip."""
        table, start_s = self._table()
        self._check(times_s)
        rest = table.at(np.array([start_s]))
        return self._scaled(table, table.at(start_s + np.asarray(times_s, np.float64)) - rest)

    def speeds(self, times_s: np.ndarray) -> Poses:
        """Return the derivatives of the poses at some instants (instants,) [s]. Raises PhotositeError as `poses`."""
        table, start_s = self._table()
        self._check(times_s)
        return self._scaled(table, table.at(start_s + np.asarray(times_s, np.float64), 1))

    def _check(self, times_s: np.ndarray) -> None:
        (first, last), needed_s = self.span_s, float(np.max(times_s, initial=0.0))
        length = f"length: {math.ceil(1e3 * needed_s - 1e-6) / 1e3:g} s"
        fix = f"write {length}"
        if needed_s > last - first:
            another = f"give another, such as {LONGEST_CLIP}, with {length}"
            if needed_s > LONGEST_CLIP_S:
                another = "no clip is that long: leave clip out and give a model, such as rms: 2 deg/s, or a path of your own"
            fix = f"the whole clip is {last - first:.4g} s long: {another}"
        elif float(np.min(times_s, initial=0.0)) < first:
            fix = "give a later exposure.start, or another seed, which chooses another place of the clip"
        check_inside(times_s, (first, last), "motion.camera.clip", self.clip, fix)

    def _scaled(self, table: PathTable, values: np.ndarray) -> Poses:
        """Return values of the table as poses of the stated speed."""
        factor = 1.0 if self.rms_deg_per_s is None else np.radians(self.rms_deg_per_s) / rms_rate_rad_per_s(table)
        return Poses(factor * values[:, 3:], factor * self.metres_per_unit * values[:, :3])

    def _table(self) -> tuple[PathTable, float]:
        """Return the clip, and its time when the clock is 0 [s]. Raises PhotositeError for a clip shorter than `length_s`."""
        table = read_path(CLIPS / f"{self.clip}.csv", COLUMNS, "motion.camera.clip")
        first, last = float(table.times_s[0]), float(table.times_s[-1])
        rule = f"the clip {self.clip} is {last - first:.4g} s long; give less, or a longer clip"
        require(self.length_s <= last - first, "motion.camera.length", f"{self.length_s:g} s", rule)
        return table, first + float(uniforms(self.seed, 1)[0]) * (last - first - self.length_s)


def rms_rate_rad_per_s(table: PathTable) -> float:
    """Return the root mean square of the speed of rotation between the lines of a table, all axes together [rad/s]."""
    rates = np.diff(table.values[:, 3:], axis=0) / np.diff(table.times_s)[:, None]
    return float(np.sqrt(np.mean(np.sum(rates**2, axis=1))))


def _body_rates(angles: np.ndarray) -> np.ndarray:
    """Return the matrices from the derivatives of Euler angles (instants, 3) to speeds about the camera's own axes."""
    (sx, sy, _), (cx, cy, _) = np.sin(angles).T, np.cos(angles).T
    one, zero = np.ones_like(sx), np.zeros_like(sx)
    return np.moveaxis(np.array([[one, zero, -sy], [zero, cx, sx * cy], [zero, -sx, cx * cy]]), 2, 0)
