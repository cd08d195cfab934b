"""Places of the scene that photosites see through a point of the pupil at an instant, in float64."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simulator.exposure.shutter import RollingShutter
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.scene_loading import load_scene
from simulator.pipeline.shot import Shot

INSTANTS = 1024  # of equal light, of the path of a camera or a layer that turns


def radius_px(lens: Lens, pitch_um: float, depth_m: float) -> float:
    """Signed blur radius [photosites]: half of f^2 / N (1/z_focus - 1/z) v / f, positive behind the focus.

    Of a pinhole: half of its diameter times 1 + v / z, negative.
    """
    if isinstance(lens, Pinhole):
        return -500.0 * lens.diameter_mm * (1.0 + 1e-3 * lens.distance_mm / depth_m) / pitch_um
    assert isinstance(lens, ThinLens)
    image_mm = 1.0 / (1.0 / lens.focal_length_mm - 1e-3 / lens.focus_distance_m)
    inverse_mm = 1e-3 * (1.0 / lens.focus_distance_m - 1.0 / depth_m)
    return 0.5 * lens.focal_length_mm / lens.f_number * image_mm * inverse_mm * 1e3 / pitch_um


@dataclass(frozen=True)
class SeenPlaces:
    """What the photosites of a window see of the surfaces of a scene.

    x, y: middles of columns and rows (columns,), (rows,) [photosites from the sensor's corner]. radii_px, depths_m: blur radius
    and distance of each surface. speeds: of each surface, to the right and down, where all move evenly and the camera stands
    [scene pixels/s]; motion: of anything else, planned for the reference path; None: that is all. opened_s: time from the
    release at which each row opens (rows,), and open_s how long each is open [s].
    """

    projection: Projection
    x: np.ndarray
    y: np.ndarray
    radii_px: tuple[float, ...]
    depths_m: tuple[float, ...]
    speeds: tuple[tuple[float, float], ...]
    motion: MotionPlan | None
    opened_s: np.ndarray
    open_s: float

    @classmethod
    def of(cls, shot: Shot, planned: Plan) -> "SeenPlaces":
        """Return what the photosites of a shot's plan see."""
        window, layers = planned.optics.window, load_scene(shot.scene).layers
        x, y = window.x + np.arange(window.width) + 0.5, window.y + np.arange(window.height) + 0.5
        depths = tuple(float(layer.depth_m) for layer in layers)
        radii = tuple(radius_px(shot.lens, shot.camera.pixel_pitch_um, depth) for depth in depths)
        motion = None
        if shot.motion is not None and not _moves_evenly(shot):
            motion = plan(replace(shot, tolerance=0.0)).optics.motion
        speeds = tuple((0.0, 0.0) if motion is not None else _speed(shot, number) for number in range(len(layers)))
        opened_s = _seconds_per_row(shot, shot.camera.height_px) * (y - 0.5)
        return cls(planned.optics.projection, x, y, radii, depths, speeds, motion, opened_s, shot.exposure.time_s)

    @property
    def is_upright(self) -> bool:
        """Whether the sides of photosites are parallel to those of the scene's pixels, all of one size."""
        return self.projection.warp is None and self.motion is None

    def places(
        self, surface: int, right_px: float, down_px: float, ray: np.ndarray, instant: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the places x, y (rows, columns) of a surface that photosites see [scene pixels].

        right_px, down_px: from the middle of a photosite. ray: (2,) place in the pupil. instant: share of the exposure's light.
        """
        radius, projection = self.radii_px[surface], self.projection
        x, y = np.broadcast_arrays(self.x + right_px + radius * ray[0], (self.y + down_px + radius * ray[1])[:, None])
        if projection.warp is not None:
            x, y = projection.warp.undistorted(x, y)
        if self.motion is not None:
            x, y = self._at_rest(surface, x, y, instant)
        right, below = self.speeds[surface]
        time_s = (self.opened_s + instant * self.open_s)[:, None]
        scale = projection.scale
        return projection.offset_x + scale * x - right * time_s, projection.offset_y + scale * y - below * time_s

    def _at_rest(self, surface: int, x: np.ndarray, y: np.ndarray, instant: float) -> tuple[np.ndarray, np.ndarray]:
        """Places on the sensor where a surface that moves is seen at rest."""
        assert self.motion is not None
        geometry = self.motion.path.motion.geometry
        centre_x, centre_y = 0.5 * geometry.width_px, 0.5 * geometry.height_px
        h = self._homographies[surface][:, min(int(instant * INSTANTS), INSTANTS - 1), :, :, None]
        x, y = x - centre_x, y - centre_y
        across, down, depth = (h[:, one, 0] * x + h[:, one, 1] * y + h[:, one, 2] for one in range(3))
        return across / depth + centre_x, down / depth + centre_y

    @cached_property
    def _homographies(self) -> list[np.ndarray]:
        """Those from the sensor to places at rest, of each surface, (rows or 1, INSTANTS, 3, 3), at instants of equal light.

        Layers at one distance are planned as one surface where none moves by itself, so that its distance is all that counts.
        """
        assert self.motion is not None
        path = self.motion.path
        rows = np.floor(self.y).astype(np.intp) if path.lines.axis == "rows" else np.zeros(1, np.intp)
        poses = path.of_lines(rows).instants(INSTANTS, "light").pose_numbers
        is_joined = len(path.motion.surfaces) < len(self.depths_m)
        return [path.motion.homographies(poses, 0 if is_joined else layer, depth) for layer, depth in enumerate(self.depths_m)]


def _moves_evenly(shot: Shot) -> bool:
    """Whether the camera stands, and layers move along straight lines."""
    motion = shot.motion
    return motion is None or (motion.camera is None and all(_is_straight(one) for one in motion.layers.values()))


def _is_straight(move: object) -> bool:
    """Whether a layer moves with one velocity in pixels per second."""
    velocity = getattr(move, "velocity", None)
    return (
        getattr(move, "spin_deg_per_s", 0.0) == 0.0
        and getattr(move, "path", None) is None
        and velocity is not None
        and all(speed.unit == "px/s" for speed in velocity)
    )


def _speed(shot: Shot, number: int) -> tuple[float, float]:
    """Speed of a layer, to the right and down [scene pixels/s]."""
    move = None if shot.motion is None else shot.motion.layers.get(number)
    if move is None or move.velocity is None:
        return 0.0, 0.0
    return move.velocity[0].value, move.velocity[1].value


def _seconds_per_row(shot: Shot, rows: int) -> float:
    """Time from the opening of a row to that of the next [s]; 0 where all open at once, whatever time their read-out takes."""
    shutter = shot.exposure.shutter
    if not isinstance(shutter, RollingShutter) or shot.motion is None:
        return 0.0
    readout_s = shot.camera.readout_time_s if shutter.readout_time_s is None else shutter.readout_time_s
    return 0.0 if readout_s is None else readout_s / rows
