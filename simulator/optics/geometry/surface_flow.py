"""Flow: how far the image of each surface moves on the sensor from one exposure to the next, by float64 geometry of points.

A photosite looks along a ray and sees the first surface at which this one and those before it cover more than half. Its point
is carried on with the surface, and its image through the camera's other pose is where it is then. Each line of the sensor has
its own instant, before as after.
"""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from simulator.exposure.motion import Motion
from simulator.optics.geometry.image_motion import ImageGeometry
from simulator.optics.lens.distortion import Warp
from simulator.scene.scene import Layer, Scene, is_depth_map

TURNS = 12  # most steps of a search by fixed point, of a point whose distance, velocity or line depends on where it is
BLOCK = 2**18  # places that are followed at once


@dataclass(frozen=True)
class LinePoses:
    """Poses of camera and surfaces, at the instant of each line of the sensor; or (lines = places) at those of some places.

    axis: whether lines are rows or columns; "all": one line is the whole sensor. times_s: (lines,) [s] of the clock.
    rotation: (lines, 3, 3), location_m: (lines, 3), of the camera, see `Poses`.
    maps: per surface (lines, 2, 3), places at rest (x, y, 1) [photosites from the optical axis] to those of the instant.
    shifts_m: per surface (lines, 2), way to the right and down [m].
    """

    axis: Literal["rows", "columns", "all"]
    times_s: np.ndarray
    rotation: np.ndarray
    location_m: np.ndarray
    maps: tuple[np.ndarray, ...]
    shifts_m: tuple[np.ndarray, ...]

    def at(self, places: np.ndarray) -> Self:
        """Return the poses at places on the sensor (n, 2) [photosites], linear between the middles of lines."""
        along, last = places[:, 0 if self.axis == "columns" else 1], len(self.times_s) - 1
        line = np.clip(np.nan_to_num(along) - 0.5, 0.0, last)
        first = line.astype(np.intp)
        second, share = np.minimum(first + 1, last), line - first

        def between(values: np.ndarray) -> np.ndarray:
            part = share.reshape(-1, *[1] * (values.ndim - 1))
            return values[first] * (1.0 - part) + values[second] * part

        maps, shifts_m = (tuple(map(between, values)) for values in (self.maps, self.shifts_m))
        camera = between(self.times_s), between(self.rotation), between(self.location_m)
        return type(self)(self.axis, *camera, maps, shifts_m)


@dataclass(frozen=True)
class SurfaceFlow:
    """Surfaces before a lens, and how they get from place to place.

    scene: whose layers. motion: of all. geometry: of the image. warp: distortion of the lens; None: none.
    velocity: (scene height, scene width, 2) of a vector map [scene px/s]; None: there is none.
    """

    scene: Scene
    motion: Motion
    geometry: ImageGeometry
    warp: Warp | None = None
    velocity: np.ndarray | None = None

    def poses(self, axis: Literal["rows", "columns", "all"], times_s: np.ndarray) -> LinePoses:
        """Return the poses at the instants of the sensor's lines (lines,) [s] of the clock.

        Raises PhotositeError for instants outside a path.
        """
        camera, to_scene = self.motion.camera_poses(times_s), self.geometry.to_scene
        height, width = self.scene.planes.shape[:2]
        maps, shifts_m = [], []
        for number in range(len(self.scene.layers)):
            moves = self.motion.layer_moves(number, times_s, (height, width))
            matrices = np.eye(3) if moves is None else np.linalg.inv(to_scene) @ moves.matrices @ to_scene
            maps.append(np.broadcast_to(matrices, (len(times_s), 3, 3))[:, :2])
            shifts_m.append(np.zeros((len(times_s), 2)) if moves is None else moves.shift_m)
        return LinePoses(axis, times_s, camera.matrices(), camera.location_m, tuple(maps), tuple(shifts_m))

    def displacements(self, before: LinePoses, after: LinePoses, places: np.ndarray) -> np.ndarray:
        """Return how far what is seen at places on the sensor has moved, (n, 2) float64, x and y [photosites].

        before, after: poses of lines. places: (n, 2) x and y from the sensor's upper left corner [photosites]. NaN where the
        camera has moved past the point, or looks away from it.
        """
        blocks = (places[first : first + BLOCK] for first in range(0, len(places), BLOCK))
        return np.concatenate([np.zeros((0, 2)), *(self._block(before, after, block) for block in blocks)])

    def _block(self, before: LinePoses, after: LinePoses, places: np.ndarray) -> np.ndarray:
        pose, seen = before.at(places), self._undistorted(places)
        ends, is_seen, transmittance = np.full_like(places, np.nan), np.zeros(len(places), bool), np.ones(len(places))
        for number, layer in enumerate(self.scene.layers):
            rest, depth_m = self._meet(pose, seen, number, layer)
            transmittance *= 1.0 - self._look_up(layer.coverage, rest, 1.0)
            chosen = ~is_seen & ((transmittance < 0.5) | (number == len(self.scene.layers) - 1))
            is_seen |= chosen
            ends[chosen] = self._follow(after, places[chosen], rest[chosen], depth_m[chosen], number)
        return ends - places

    def _meet(self, pose: LinePoses, seen: np.ndarray, number: int, layer: Layer) -> tuple[np.ndarray, np.ndarray]:
        """Return where rays of undistorted places (n, 2) meet a surface: its place at rest (n, 2), distance (n,) [m]."""
        far, rest = self.geometry.image_distance_px, seen
        ray = np.column_stack([seen[:, 0], -seen[:, 1], np.full(len(seen), -far)])
        direction = np.einsum("nij,nj->ni", pose.rotation, ray)
        depth_m, place = self._look_up(layer.depth_m, rest, np.inf), pose.maps[number]
        for _ in range(TURNS):
            dioptres, before = pose.location_m / depth_m[:, None], rest
            along = (1.0 + dioptres[:, 2:]) * far / -direction[:, 2:]
            met = along * direction[:, :2] + far * dioptres[:, :2]
            now = np.column_stack([met[:, 0], -met[:, 1]]) - far * pose.shifts_m[number] / depth_m[:, None]
            offset = now - self._way(rest, pose.times_s) - place[:, :, 2]
            rest = np.linalg.solve(place[:, :, :2], offset[..., None])[..., 0]
            if np.array_equal(rest, before) or (self.velocity is None and not is_depth_map(layer.depth_m)):
                break
            depth_m = self._look_up(layer.depth_m, rest, np.inf)
        return rest, depth_m

    def _follow(self, after: LinePoses, places: np.ndarray, rest: np.ndarray, depth_m: np.ndarray, number: int) -> np.ndarray:
        """Return where points of a surface are seen after, (n, 2) [photosites from the sensor's corner]; places: before."""
        far, ends = self.geometry.image_distance_px, places
        for _ in range(TURNS):
            pose, before = after.at(ends), ends
            place = pose.maps[number]
            now = np.einsum("nij,nj->ni", place[:, :, :2], rest) + place[:, :, 2] + self._way(rest, pose.times_s)
            now = now + far * pose.shifts_m[number] / depth_m[:, None]
            point = np.column_stack([now[:, 0], -now[:, 1], np.full(len(now), -far)]) / far - pose.location_m / depth_m[:, None]
            own = np.einsum("nji,nj->ni", pose.rotation, point)
            ahead = np.where(own[:, 2:] < 0.0, -own[:, 2:], np.nan)
            ends = self._distorted(np.column_stack([own[:, 0], -own[:, 1]]) * (far / ahead))
            if len(after.times_s) == 1 or np.array_equal(ends, before, equal_nan=True):
                break
        return ends

    def _way(self, rest: np.ndarray, times_s: np.ndarray) -> np.ndarray | float:
        """Return the way of points at places at rest by the vector map, (n, 2) [photosites]."""
        if self.velocity is None:
            return 0.0
        return self._look_up(self.velocity, rest, 0.0) * (times_s[:, None] / self.geometry.scale)

    def _look_up(self, values: np.ndarray | float | None, rest: np.ndarray, otherwise: float) -> np.ndarray:
        """Return a map of the scene at places at rest (n, 2), of the nearest pixel, float64 (n, ...); a number at all."""
        if values is None or np.ndim(values) == 0:
            return np.full(len(rest), otherwise if values is None else values, np.float64)
        picture = np.asarray(values)
        x, y = (rest * self.geometry.scale + (self.geometry.axis_x, self.geometry.axis_y)).T
        column = np.clip(np.floor(np.nan_to_num(x)), 0, picture.shape[1] - 1).astype(np.intp)
        row = np.clip(np.floor(np.nan_to_num(y)), 0, picture.shape[0] - 1).astype(np.intp)
        return picture[row, column].astype(np.float64)

    def _undistorted(self, places: np.ndarray) -> np.ndarray:
        """Return places on the sensor as an ideal lens has them, (n, 2) [photosites from the optical axis]."""
        x, y = places.T
        if self.warp is not None:
            x, y = self.warp.undistorted(x, y, self._channel)
        return np.column_stack([x - 0.5 * self.geometry.width_px, y - 0.5 * self.geometry.height_px])

    def _distorted(self, seen: np.ndarray) -> np.ndarray:
        """Invert `_undistorted`."""
        x, y = seen[:, 0] + 0.5 * self.geometry.width_px, seen[:, 1] + 0.5 * self.geometry.height_px
        return np.column_stack((x, y) if self.warp is None else self.warp.distorted(x, y, self._channel))

    @property
    def _channel(self) -> int:
        """Colour whose distortion counts: green, as in kernels/projection.cl."""
        return 0 if self.warp is None else min(1, len(self.warp.magnification) - 1)
