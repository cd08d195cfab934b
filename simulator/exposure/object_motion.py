"""Motion of things in the scene: of a layer as a whole."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.exposure.path_table import check_inside, read_path
from simulator.units import DegreesPerSecond

SpeedUnit = Literal["px/s", "m/s", "px/frame", "m/frame"]
COLUMNS = "x_px", "y_px", "x_m", "y_m", "rotation_deg"
IN_METRES = slice(2, 4)  # of the columns


@dataclass(frozen=True)
class Speed:
    """Speed of a surface, in pixels of the scene or in metres where the surface is, per second or per frame time."""

    value: float
    unit: SpeedUnit

    def per_second(self, frame_time_s: float | None) -> float:
        """Return the speed in its unit of length per second."""
        if not self.unit.endswith("/frame"):
            return self.value
        assert frame_time_s is not None  # `Motion` asks for it
        return self.value / frame_time_s

    @property
    def is_per_frame(self) -> bool:
        """Whether it is the way in a frame time."""
        return self.unit.endswith("/frame")

    @property
    def is_in_metres(self) -> bool:
        """Whether the way on the picture depends on the distance."""
        return self.unit.startswith("m")


@dataclass(frozen=True)
class LayerMoves:
    """Where a layer is at some instants, relative to where the scene shows it.

    Positions on the scene: x from its left edge, y from its upper edge [px]; the centre of the first pixel is (0.5, 0.5).
    matrices: (instants, 3, 3) float64, homogeneous coordinates (x, y, 1) of the layer at rest to those at the instant [px].
    shift_m: (instants, 2) float64, way to the right and down, across the optical axis, on top of it [m]: a surface at distance
        Z moves by focal_px * shift_m / Z, focal_px pixels of the scene being one unit of the tangent of the field angle.
    """

    matrices: np.ndarray
    shift_m: np.ndarray


@dataclass(frozen=True)
class LayerMotion:
    """Motion of one layer of the scene, which is where the picture shows it when the clock is 0.

    velocity: to the right and down, such as [120 px/s, 0 px/s] in pixels of the scene or [1.5 m/s, 0 m/s] at its distance; per
        frame: px/frame, m/frame.
    spin_deg_per_s: speed of rotation about `centre`, counter-clockwise as it is seen [deg/s].
    centre_px: x from the left edge and y from the upper edge of the scene, in its pixels; left out: the middle of the scene.
    """

    velocity: tuple[Speed, Speed] | None = None
    spin_deg_per_s: DegreesPerSecond = 0.0
    centre_px: tuple[float, float] | None = None
    path: Annotated[
        Path | None, "CSV with the columns time_s and x_px, y_px or x_m, y_m, and rotation_deg; added to the steady motion"
    ] = None

    def __post_init__(self) -> None:
        key = "motion.layers"
        for speed in self.velocity or ():
            text = f"{speed.value} {speed.unit}"
            require(math.isfinite(speed.value), f"{key}.velocity", text, "give a finite speed, such as 120 px/s")
        spin = self.spin_deg_per_s
        require(math.isfinite(spin), f"{key}.spin", f"{spin} deg/s", "give a finite speed, such as 360 deg/s")
        centre = self.centre_px
        finite = centre is None or all(map(math.isfinite, centre))
        require(finite, f"{key}.centre", centre, "give a place on the scene in pixels, such as [320, 240]")
        if self.velocity is not None and len({speed.is_in_metres for speed in self.velocity}) > 1:
            shown = ", ".join(f"{speed.value:g} {speed.unit}" for speed in self.velocity)
            raise PhotositeError("give both in pixels or both in metres", key=f"{key}.velocity", value=f"[{shown}]")

    @property
    def is_per_frame(self) -> bool:
        """Whether a speed is stated per frame."""
        return any(speed.is_per_frame for speed in self.velocity or ())

    def moved_in_metres(self, key: str) -> tuple[str, object] | None:
        """Return the key and the value of what moves the layer by metres; None: nothing does.

        key: of the layer. Raises PhotositeError for a table as `read_path` does.
        """
        for speed in self.velocity or ():
            if speed.is_in_metres and speed.value:
                return f"{key}.velocity", speed.unit
        if self.path is not None and read_path(self.path, COLUMNS, f"{key}.path").values[:, IN_METRES].any():
            return f"{key}.path", self.path
        return None

    def fastest_hz(self, key: str = "motion.layers") -> float:
        """Return the turns in a second, and the highest frequency of the table if that is more [Hz].

        key: of the layer, for messages. Raises PhotositeError for a table as `read_path` does.
        """
        turns = abs(self.spin_deg_per_s) / 360.0
        return turns if self.path is None else max(turns, read_path(self.path, COLUMNS, f"{key}.path").highest_hz)

    def moves(
        self, times_s: np.ndarray, size: tuple[int, int], frame_time_s: float | None = None, key: str = "motion.layers"
    ) -> LayerMoves:
        """Return where the layer is at some instants (instants,) of the clock [s].

        size: (height, width) of the scene [px]. frame_time_s: see `Speed`. key: of the layer, for messages.
        Raises PhotositeError for a table as `read_path` does, and for instants outside it.
        """
        times_s = np.asarray(times_s, np.float64)
        way_px, way_m, angle_rad = self._table(times_s, f"{key}.path")
        angle_rad = angle_rad + np.radians(self.spin_deg_per_s) * times_s
        if self.velocity is not None:
            steady = np.multiply.outer(times_s, [speed.per_second(frame_time_s) for speed in self.velocity])
            if self.velocity[0].is_in_metres:
                way_m = way_m + steady
            else:
                way_px = way_px + steady
        centre = np.array((0.5 * size[1], 0.5 * size[0]) if self.centre_px is None else self.centre_px)
        sine, cosine = np.sin(angle_rad), np.cos(angle_rad)
        matrices = np.zeros((len(times_s), 3, 3))
        matrices[:, 0, 0], matrices[:, 0, 1] = cosine, sine  # y points down, so that this turns counter-clockwise
        matrices[:, 1, 0], matrices[:, 1, 1] = -sine, cosine
        matrices[:, :2, 2] = centre + way_px - matrices[:, :2, :2] @ centre
        matrices[:, 2, 2] = 1.0
        return LayerMoves(matrices, way_m)

    def _table(self, times_s: np.ndarray, key: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return way (instants, 2) [px], way (instants, 2) [m] and angle (instants,) [rad] of the table."""
        if self.path is None:
            return np.zeros((len(times_s), 2)), np.zeros((len(times_s), 2)), np.zeros(len(times_s))
        table = read_path(self.path, COLUMNS, key)
        check_inside(times_s, (float(table.times_s[0]), float(table.times_s[-1])), key, self.path)
        values = table.at(times_s)
        return values[:, :2], values[:, IN_METRES], np.radians(values[:, 4])
