"""Motion of the camera: its pose over time."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.errors import require
from simulator.units import DegreesPerSecond, MetresPerSecond

ANY_TIME = (-math.inf, math.inf)  # span of a path without ends [s]


@dataclass(frozen=True)
class Poses:
    """Where the camera is and where it looks, at some instants; or how fast both change.

    Axes of the camera at rest, in whose view the scene is given: x right, y up, z back towards the photographer (Blender's).
    rotation_rad: (instants, 3) float64, rotation about x, y and z [rad]: tilt (up is > 0), pan (left is > 0) and roll
        (counter-clockwise is > 0), applied as Rz Ry Rx (Euler angles XYZ).
    location_m: (instants, 3) float64, of the lens's centre [m].
    Of speeds, the derivatives of the same numbers by time [rad/s], [m/s].
    """

    rotation_rad: np.ndarray
    location_m: np.ndarray

    def matrices(self) -> np.ndarray:
        """Return Rz Ry Rx, (instants, 3, 3) float64: directions in the camera's axes to those of the camera at rest."""
        return rotation_matrices(self.rotation_rad)


class CameraPath(Protocol):
    """Pose of the camera over time. One path drives the rows of a frame, the frames of a burst, and the gaps between them.

    The pose is relative to that when the clock is 0, at which the scene is given.
    """

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last time of the shot's clock at which there is a pose [s]; infinite for a path without ends."""
        ...

    @property
    def fastest_hz(self) -> float:
        """Highest frequency at which the pose may change [Hz]; 0 for one that changes evenly. Raises as `poses`."""
        ...

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s] of the shot's clock, on which `Exposure.start_s` is a time.

        Raises PhotositeError for instants outside a path of limited length, which names the path, its span and that of the
        instants.
        """
        ...

    def speeds(self, times_s: np.ndarray) -> Poses:
        """Return the derivatives of the poses by time at some instants (instants,) [s]. Raises PhotositeError as `poses`."""
        ...


@dataclass(frozen=True)
class SteadyMotion:
    """Camera that turns and moves at constant speed, at rest in the scene's view when the clock is 0.

    tilt_deg_per_s: speed of rotation about x [deg/s]; above 0 the camera turns up.
    pan_deg_per_s: about y [deg/s]; above 0 it turns left.
    roll_deg_per_s: about z [deg/s]; above 0 it turns counter-clockwise.
    right_m_per_s: speed along x [m/s].
    up_m_per_s: along y [m/s].
    back_m_per_s: along z, away from the scene [m/s].
    """

    tilt_deg_per_s: DegreesPerSecond = 0.0
    pan_deg_per_s: DegreesPerSecond = 0.0
    roll_deg_per_s: DegreesPerSecond = 0.0
    right_m_per_s: MetresPerSecond = 0.0
    up_m_per_s: MetresPerSecond = 0.0
    back_m_per_s: MetresPerSecond = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            key, unit = name.partition("_")[0], "deg/s" if "_deg_" in name else "m/s"
            require(math.isfinite(value), f"motion.camera.{key}", f"{value} {unit}", f"give a finite speed, such as 1 {unit}")

    @property
    def span_s(self) -> tuple[float, float]:
        """No ends [s]."""
        return ANY_TIME

    @property
    def fastest_hz(self) -> float:
        """Turns in a second about the axis of the fastest rotation [Hz]."""
        return max(abs(self.tilt_deg_per_s), abs(self.pan_deg_per_s), abs(self.roll_deg_per_s)) / 360.0

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s]."""
        steady, times_s = self.speeds(times_s), np.asarray(times_s, np.float64)[:, None]
        return Poses(steady.rotation_rad * times_s, steady.location_m * times_s)

    def speeds(self, times_s: np.ndarray) -> Poses:
        """Return the derivatives of the poses at some instants (instants,) [s]."""
        turn = np.radians([self.tilt_deg_per_s, self.pan_deg_per_s, self.roll_deg_per_s])
        move = np.array([self.right_m_per_s, self.up_m_per_s, self.back_m_per_s])
        shape = len(times_s), 3
        return Poses(np.broadcast_to(turn, shape), np.broadcast_to(move, shape))


def rotation_matrices(rotation_rad: np.ndarray) -> np.ndarray:
    """Return Rz Ry Rx of Euler angles about x, y and z (..., 3) [rad], (..., 3, 3) float64."""
    (sx, sy, sz), (cx, cy, cz) = (np.moveaxis(part(rotation_rad), -1, 0) for part in (np.sin, np.cos))
    rows = (
        (cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx),
        (sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx),
        (-sy, cy * sx, cy * cx),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def euler_angles(matrices: np.ndarray) -> np.ndarray:
    """Return the angles about x, y and z (instants, 3) [rad] of which `rotation_matrices` makes these (instants, 3, 3).

    The angle about y lies within a quarter turn of 0, those about x and z within half a turn.
    """
    about_x = np.arctan2(matrices[:, 2, 1], matrices[:, 2, 2])
    about_y = np.arctan2(-matrices[:, 2, 0], np.hypot(matrices[:, 2, 1], matrices[:, 2, 2]))
    about_z = np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0])
    return np.stack([about_x, about_y, about_z], axis=1)
