"""Where the image of each surface lies while the camera and the surfaces move: exact pinhole geometry, in float64.

A photosite looks along one ray through the lens's centre. The camera's rotation turns the ray, its location moves the ray's
start; where the ray meets a surface, the photosite sees what it would see there with everything at rest. For a plane at one
distance, parallel to the sensor at rest, that place is a homography of the photosite's (Hartley and Zisserman, Multiple View
Geometry, 2nd ed., 13.1). A layer that moves across the picture is carried back to its place at rest.

Axes of space: those of `Poses`, x right, y up, z back. Axes of the image: x right, y down, in photosites from the optical axis.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import CameraPath, rotation_matrices
from simulator.exposure.object_motion import LayerMoves
from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.lens import Lens
from simulator.sensor.camera.camera import Camera

CAMERA_NUMBERS, LAYER_NUMBERS = 6, 8  # numbers of a pose: rotation [rad] and location [m]; affine map and shift [m]
LayerPath = Callable[[np.ndarray], LayerMoves]  # where a layer is at some instants (instants,) [s] of the shot's clock


@dataclass(frozen=True)
class ImageGeometry:
    """Pinhole geometry of the image on a sensor, whose middle the optical axis meets.

    image_distance_px: lens to sensor [photosites]. width_px, height_px: of the sensor.
    scale: scene pixels per photosite. axis_x, axis_y: scene position of the optical axis [px].
    """

    image_distance_px: float
    width_px: int
    height_px: int
    scale: float = 1.0
    axis_x: float = 0.0
    axis_y: float = 0.0

    def corners(self) -> np.ndarray:
        """Corners, middles of the sides and middle of the sensor from the optical axis, (9, 2) [photosites]."""
        x, y = np.meshgrid([-0.5, 0.0, 0.5], [-0.5, 0.0, 0.5])
        return np.stack([self.width_px * x.ravel(), self.height_px * y.ravel()], axis=-1)

    @property
    def to_scene(self) -> np.ndarray:
        """Matrix (3, 3) from places (x, y, 1) [photosites from the optical axis] to scene positions [px]."""
        return np.array([[self.scale, 0.0, self.axis_x], [0.0, self.scale, self.axis_y], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Surface:
    """A surface of a scene as its motion needs it.

    nearest_m, farthest_m: range of its distance along the optical axis at rest [m]. path: its own motion; None: it rests.
    """

    nearest_m: float
    farthest_m: float
    path: LayerPath | None = None


@dataclass(frozen=True)
class ImageMotion:
    """Motion of the images of a scene's surfaces.

    geometry: of the image. surfaces: front to back. camera: its path; None: it rests.
    drifts_px: (corners, 2) float64, corners of a polygon around the velocities of all pixels of the only surface, to the right
        and down [photosites/s], on top of its path; None: pixels do not move by themselves.
    spot_px: x, y of the photosites from those of the sensor, where a filter shifts what they see; homographies then take places
        from this one on to places from this one on.
    fastest_hz: highest frequency at which anything may move [Hz].
    """

    geometry: ImageGeometry
    surfaces: tuple[Surface, ...]
    camera: CameraPath | None = None
    drifts_px: np.ndarray | None = None
    spot_px: tuple[float, float] = (0.0, 0.0)
    fastest_hz: float = 0.0

    def is_at_rest(self, surface: int) -> bool:
        """Whether the image of a surface is where it is at rest at every instant."""
        return self.camera is None and self.drifts_px is None and self.surfaces[surface].path is None

    def pose_numbers(self, times_s: np.ndarray) -> np.ndarray:
        """Return the poses of all that moves at some instants (instants,) [s] of the clock, (instants, numbers) float64.

        The camera's first, where it moves, then those of surfaces, then the time where pixels move. A mean of them is that of
        the poses.
        """
        parts = [np.zeros((len(times_s), 0))]
        if self.camera is not None:
            pose = self.camera.poses(times_s)
            parts += [pose.rotation_rad, pose.location_m]
        to_scene = self.geometry.to_scene
        for surface in self.surfaces:
            if surface.path is not None:
                moves = surface.path(times_s)
                matrices = np.linalg.inv(to_scene) @ moves.matrices @ to_scene
                parts += [matrices[:, :2].reshape(-1, 6), moves.shift_m]
        if self.drifts_px is not None:
            parts.append(times_s[:, None])
        return np.concatenate(parts, axis=-1)

    def _camera(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (..., 3, 3) and location (..., 3) [m] of the camera."""
        if self.camera is None:
            return np.broadcast_to(np.eye(3), (*numbers.shape[:-1], 3, 3)), np.zeros((*numbers.shape[:-1], 3))
        return rotation_matrices(numbers[..., :3]), numbers[..., 3:CAMERA_NUMBERS]

    def _layer(self, numbers: np.ndarray, surface: int) -> tuple[np.ndarray, np.ndarray] | None:
        """Return what takes places now to those at rest, (..., 2, 3), and the shift of the surface (..., 2) [m] before.

        None for a surface at rest. The shift is to the right and down.
        """
        if self.surfaces[surface].path is None:
            return None
        before = sum(one.path is not None for one in self.surfaces[:surface])
        first = (CAMERA_NUMBERS if self.camera is not None else 0) + LAYER_NUMBERS * before
        own = numbers[..., first : first + LAYER_NUMBERS]
        forward = own[..., :6].reshape(*own.shape[:-1], 2, 3)
        back = np.linalg.inv(forward[..., :2])
        return np.concatenate([back, -back @ forward[..., 2:]], axis=-1), own[..., 6:]

    def homographies(self, numbers: np.ndarray, surface: int, depth_m: float | None = None) -> np.ndarray:
        """Return what takes a place on the sensor to the place seen there at rest, (..., 3, 3) float64.

        Both places are (x, y, 1) from the optical axis [photosites]; the element [2, 2] is 1. numbers: (..., numbers) of
        `pose_numbers`. depth_m: distance of the surface; left out: its nearest. Raises PhotositeError where a photosite of the
        sensor does not see the surface's plane.
        """
        depth = self.surfaces[surface].nearest_m if depth_m is None else depth_m
        rotation, location = self._camera(numbers)
        distance = self.geometry.image_distance_px
        ray = rotation @ np.diag([1.0, -1.0, -distance])  # of (x, y, 1): direction in the axes at rest
        dioptres = location / depth  # 0 for a surface at infinity
        # place / distance = ray_xy (1 + z / depth) / -ray_z + location_xy / depth, as in parallax(), times -ray_z
        across = (1.0 + dioptres[..., 2, None]) * ray[..., 0, :] - dioptres[..., 0, None] * ray[..., 2, :]
        up = (1.0 + dioptres[..., 2, None]) * ray[..., 1, :] - dioptres[..., 1, None] * ray[..., 2, :]
        found = np.stack([distance * across, -distance * up, -ray[..., 2, :]], axis=-2)
        self._check(found, dioptres)
        if (layer := self._layer(numbers, surface)) is not None:
            back, shift_m = layer
            found[..., :2, :] -= (distance / depth) * shift_m[..., None] * found[..., 2:, :]
            found = np.concatenate([back @ found, found[..., 2:, :]], axis=-2)
        if self.spot_px != (0.0, 0.0):
            there = np.eye(3)
            there[:2, 2] = self.spot_px
            found = np.linalg.inv(there) @ found @ there
        return found / found[..., 2:, 2:]

    def _check(self, found: np.ndarray, dioptres: np.ndarray) -> None:
        """Raise PhotositeError for a homography under which a part of the sensor looks away from the surface's plane."""
        places = np.append(self.geometry.corners(), np.ones((9, 1)), axis=1)
        depth = found[..., 2, :] @ places.T
        if bool(np.all(depth > 1e-3 * self.geometry.image_distance_px)) and bool(np.all(dioptres[..., 2] > -1.0)):
            return
        raise PhotositeError(
            "a part of the sensor looks past the scene while the shutter is open; turn the camera by less than "
            "90 deg less half the field of view, and do not move it through a surface",
            key="motion",
        )

    def check_view(self, numbers: np.ndarray) -> None:
        """Raise PhotositeError where a part of the sensor looks away from a surface; numbers: poses, as of `homographies`."""
        if self.camera is not None:
            for surface in range(len(self.surfaces)):
                self.homographies(numbers, surface)

    def parallax(self, numbers: np.ndarray, surface: int, places_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where photosites look at infinity, and how that shifts per inverse distance: both (..., places, 2) float64.

        The place seen at rest on a surface at a distance Z [m] is at_infinity + shift / Z, from the optical axis [photosites]:
        exact for any pose. shift: [photosites per 1/m]. numbers: (..., numbers) of `pose_numbers`.
        places_px: (places, 2) x, y from the optical axis [photosites].
        """
        distance = self.geometry.image_distance_px
        rotation, location = self._camera(numbers)
        x, y = np.asarray(places_px, np.float64).T
        ray = np.stack([x, -y, np.full_like(x, -distance)]) / distance
        turned = np.moveaxis(rotation @ ray, -2, 0)
        infinity = np.stack([turned[0], -turned[1]], axis=-1) * (distance / -turned[2])[..., None]
        aside = distance * np.stack([location[..., 0], -location[..., 1]], axis=-1)[..., None, :]
        shift = aside + infinity * location[..., 2, None, None]
        if (layer := self._layer(numbers, surface)) is not None:
            back, shift_m = layer
            turn = np.swapaxes(back[..., :2], -1, -2)
            shift = (shift - distance * shift_m[..., None, :]) @ turn
            infinity = infinity @ turn + back[..., None, :, 2]
        return infinity, shift

    def turns(self, numbers: np.ndarray, surface: int) -> np.ndarray:
        """Return what takes steps on the sensor to steps on a surface at rest, (..., 2, 2) float64: its own turn, and the roll.

        What a camera that goes nearer or turns aside changes in steps is left out: blur radii are those at rest, too.
        numbers: (..., numbers) of `pose_numbers`.
        """
        rotation, _ = self._camera(numbers)
        turn = rotation[..., :2, :2] * np.array([[1.0, -1.0], [-1.0, 1.0]])  # y of the image points down
        layer = self._layer(numbers, surface)
        return turn if layer is None else layer[0][..., :2] @ turn

    def displacements(self, numbers: np.ndarray) -> np.ndarray:
        """Return how far the image lies from that at rest, (..., views, 2) [photosites].

        views: each of the 9 `ImageGeometry.corners`, at the nearest and the farthest distance of each surface, with each of the
        drifts where pixels move.
        """
        corners, found = self.geometry.corners(), []
        for index, surface in enumerate(self.surfaces):
            infinity, shift = self.parallax(numbers, index, corners)
            found += [infinity + shift / depth_m - corners for depth_m in (surface.nearest_m, surface.farthest_m)]
        views = np.concatenate(found, axis=-2)
        if self.drifts_px is None:
            return views
        if self.camera is None:  # all views are alike
            views = views[..., :1, :]
        ways = numbers[..., -1:, None] * self.drifts_px
        return (views[..., None, :] - ways[..., None, :, :]).reshape(*views.shape[:-2], -1, 2)


def plan_geometry(lens: Lens, camera: Camera, projection: Projection) -> ImageGeometry:
    """Return the geometry of a lens's image on a camera's sensor; the lens forms an image. projection: of the scene onto it."""
    scale, (width, height) = projection.scale, (camera.width_px, camera.height_px)
    axis = projection.offset_x + 0.5 * scale * width, projection.offset_y + 0.5 * scale * height
    return ImageGeometry(1e3 * lens.image_distance_mm / camera.pixel_pitch_um, width, height, scale, *axis)
