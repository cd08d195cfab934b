"""Where the image of each surface lies while the camera and the surfaces move: exact pinhole geometry, in float64.

A photosite looks along one ray through the lens's centre. The camera's rotation turns the ray, its location moves the ray's
start; where the ray meets a surface, the photosite sees what it would see there with everything at rest. For a plane at one
distance, parallel to the sensor at rest, that place is a homography of the photosite's (Hartley and Zisserman, Multiple View
Geometry, 2nd ed., 13.1). A surface that moves as a rigid body is a camera that moves the other way.

Axes of space: those of `Poses`, x right, y up, z back. Axes of the image: x right, y down, in photosites from the optical axis.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import CameraPath, Poses
from simulator.optics.lens.lens import Lens
from simulator.sensor.camera.camera import Camera

POSE_NUMBERS = 6  # of one body: rotation about x, y, z [rad], location x, y, z [m]


class BodyPath(Protocol):
    """Pose of a rigid body over time: of the camera, or of a surface, whose pose at rest is zero."""

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s] of the shot's clock."""
        ...


@dataclass(frozen=True)
class ImageGeometry:
    """Pinhole geometry of the image on a sensor.

    image_distance_px: lens to sensor [photosites]. width_px, height_px: of the sensor; the optical axis meets its middle.
    """

    image_distance_px: float
    width_px: int
    height_px: int

    @property
    def centre_px(self) -> tuple[float, float]:
        """Place x, y of the optical axis from the sensor's upper left corner [photosites]."""
        return 0.5 * self.width_px, 0.5 * self.height_px

    def corners(self) -> np.ndarray:
        """Corners, middles of the sides and middle of the sensor from the optical axis, (9, 2) [photosites]."""
        x, y = np.meshgrid([-0.5, 0.0, 0.5], [-0.5, 0.0, 0.5])
        return np.stack([self.width_px * x.ravel(), self.height_px * y.ravel()], axis=-1)


@dataclass(frozen=True)
class Surface:
    """A surface of a scene as its motion needs it.

    nearest_m, farthest_m: range of its distance along the optical axis at rest [m]. path: its own motion; None: it rests.
    """

    nearest_m: float
    farthest_m: float
    path: BodyPath | None = None


@dataclass(frozen=True)
class ImageMotion:
    """Motion of the images of a scene's surfaces.

    geometry: of the image. surfaces: front to back. camera: its path; None: it rests.
    """

    geometry: ImageGeometry
    surfaces: tuple[Surface, ...]
    camera: CameraPath | None = None

    def bodies(self) -> list[BodyPath]:
        """Return the paths of all that moves: the camera's first, where it moves, then those of surfaces."""
        paths = [self.camera, *(surface.path for surface in self.surfaces)]
        return [path for path in paths if path is not None]

    def pose_numbers(self, times_s: np.ndarray) -> np.ndarray:
        """Return the poses of all bodies at some instants (instants,) [s], (instants, 6 bodies); their means are mean poses."""
        found = [path.poses(times_s) for path in self.bodies()]
        parts = [part for pose in found for part in (pose.rotation_rad, pose.location_m)]
        return np.concatenate([np.zeros((len(times_s), 0)), *parts], axis=-1)

    def seen_from(self, numbers: np.ndarray, surface: int) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (..., 3, 3) and location (..., 3) [m] of the camera in the axes of a surface.

        numbers: (..., 6 bodies) of `pose_numbers`. Rays of the camera times the rotation are rays in the surface's axes.
        """
        shape, place = numbers.shape[:-1], 0
        rotation, location = np.broadcast_to(np.eye(3), (*shape, 3, 3)), np.zeros((*shape, 3))
        if self.camera is not None:
            rotation, location, place = rotation_matrices(numbers[..., :3]), numbers[..., 3:6], POSE_NUMBERS
        for index, one in enumerate(self.surfaces):
            if one.path is None:
                continue
            if index == surface:
                back = np.swapaxes(rotation_matrices(numbers[..., place : place + 3]), -1, -2)
                offset = location - numbers[..., place + 3 : place + POSE_NUMBERS]
                return back @ rotation, np.einsum("...ij,...j->...i", back, offset)
            place += POSE_NUMBERS
        return rotation, location

    def homographies(self, numbers: np.ndarray, surface: int, depth_m: float | None = None) -> np.ndarray:
        """Return what takes a place on the sensor to the place seen there at rest, (..., 3, 3) float64.

        Both places are (x, y, 1) from the optical axis [photosites]; the element [2, 2] is 1. numbers: (..., 6 bodies) of
        `pose_numbers`. depth_m: distance of the surface; left out: its nearest. Raises PhotositeError where a photosite of the
        sensor does not see the surface's plane.
        """
        depth = self.surfaces[surface].nearest_m if depth_m is None else depth_m
        rotation, location = self.seen_from(numbers, surface)
        distance = self.geometry.image_distance_px
        to_ray = np.diag([1.0, -1.0, -distance])  # (x, y, 1) to the direction in the camera's axes
        ray = rotation @ to_ray
        dioptres = location / depth  # 0 for a surface at infinity
        # place / distance = (ray_xy (depth + z) / -ray_z + location_xy) / depth, as in parallax(), times -ray_z
        across = (1.0 + dioptres[..., 2, None]) * ray[..., 0, :] - dioptres[..., 0, None] * ray[..., 2, :]
        up = (1.0 + dioptres[..., 2, None]) * ray[..., 1, :] - dioptres[..., 1, None] * ray[..., 2, :]
        found = np.stack([distance * across, -distance * up, -ray[..., 2, :]], axis=-2)
        self._check(found, dioptres)
        return found / found[..., 2:, 2:]

    def _check(self, found: np.ndarray, dioptres: np.ndarray) -> None:
        """Raise PhotositeError for a homography under which a part of the sensor looks away from the surface's plane."""
        places = np.append(self.geometry.corners(), np.ones((9, 1)), axis=1)
        depth = found[..., 2, :] @ places.T
        if bool(np.all(depth > 1e-3 * self.geometry.image_distance_px)) and bool(np.all(dioptres[..., 2] > -1.0)):
            return
        raise PhotositeError(
            "a part of the sensor looks past the scene while the shutter is open; turn the camera or the surface by less "
            "than 90 deg less half the field of view, and do not move through a surface",
            key="motion",
        )

    def parallax(self, numbers: np.ndarray, surface: int, places_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where photosites look at infinity, and how that shifts per inverse distance: both (..., places, 2) float64.

        The place seen at rest on a surface at a distance Z [m] is at_infinity + shift / Z, from the optical axis [photosites]:
        exact for any pose. shift: [photosites per 1/m].
        numbers: (..., 6 bodies) of `pose_numbers`. places_px: (places, 2) x, y from the optical axis [photosites].
        """
        distance = self.geometry.image_distance_px
        rotation, location = self.seen_from(numbers, surface)
        x, y = np.asarray(places_px, np.float64).T
        ray = np.stack([x, -y, np.full_like(x, -distance)]) / distance
        turned = np.moveaxis(rotation @ ray, -2, 0)
        infinity = np.stack([turned[0], -turned[1]], axis=-1) * (distance / -turned[2])[..., None]
        aside = distance * np.stack([location[..., 0], -location[..., 1]], axis=-1)[..., None, :]
        return infinity, aside + infinity * location[..., 2, None, None]

    def displacements(self, numbers: np.ndarray) -> np.ndarray:
        """Return how far the image lies from that at rest, (..., views, 2) [photosites].

        views: each of the 9 `ImageGeometry.corners`, at the nearest and the farthest distance of each surface.
        """
        corners, found = self.geometry.corners(), []
        for index, surface in enumerate(self.surfaces):
            infinity, shift = self.parallax(numbers, index, corners)
            found += [infinity + shift / depth_m - corners for depth_m in (surface.nearest_m, surface.farthest_m)]
        return np.concatenate(found, axis=-2)


def plan_geometry(lens: Lens, camera: Camera) -> ImageGeometry:
    """Return the geometry of a lens's image on a camera's sensor; the lens forms an image."""
    return ImageGeometry(1e3 * lens.image_distance_mm / camera.pixel_pitch_um, camera.width_px, camera.height_px)


def rotation_matrices(rotation_rad: np.ndarray) -> np.ndarray:
    """Return Rz Ry Rx, (..., 3, 3), of angles (..., 3) about x, y and z [rad] (`Poses`)."""
    (cx, cy, cz), (sx, sy, sz) = (np.moveaxis(part(rotation_rad), -1, 0) for part in (np.cos, np.sin))
    rows: Sequence[Sequence[np.ndarray]] = (
        (cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz),
        (cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz),
        (-sy, sx * cy, cx * cy),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def aperture_shift(lens: Lens, camera: Camera, infinity_px: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return `parallax` as a shift of the point of the aperture [pupil radii] and a place on the sensor [photosites].

    The place seen at rest on a surface of signed blur radius R [photosites] is R * aperture + place, since R is linear in the
    inverse distance (`Lens.blur_radius_um`): R = R_infinity - growth / Z. infinity_px, shift: as of `parallax`.
    """
    at_infinity = float(lens.blur_radius_um(math.inf)) / camera.pixel_pitch_um
    growth = at_infinity - float(lens.blur_radius_um(1.0)) / camera.pixel_pitch_um
    aperture = -shift / growth
    return aperture, infinity_px - at_infinity * aperture
