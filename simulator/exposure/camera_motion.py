"""Motion of the camera: its pose over time."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.errors import require
from simulator.units import DegreesPerSecond, MetresPerSecond


@dataclass(frozen=True)
class Poses:
    """Where the camera is and where it looks, at some instants.

    Axes of the camera at rest, in whose view the scene is given: x right, y up, z back towards the photographer (Blender's).
    rotation_rad: (instants, 3) float64, rotation about x, y and z [rad]: tilt (up is > 0), pan (left is > 0) and roll
        (counter-clockwise is > 0), applied as Rz Ry Rx (Euler angles XYZ).
    location_m: (instants, 3) float64, of the lens's centre [m].
    """

    rotation_rad: np.ndarray
    location_m: np.ndarray


class CameraPath(Protocol):
    """Pose of the camera over time. One path drives the rows of a frame, the frames of a burst, and the gaps between them."""

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s] of the shot's clock, on which `Exposure.start_s` is a time.

        Raises PhotositeError for instants outside a path of limited length.
        """
        ...


@dataclass(frozen=True)
class SteadyMotion:
    """Camera that turns and moves at constant speed, at rest in the scene's view when the clock is 0.

    tilt_deg_per_s, pan_deg_per_s, roll_deg_per_s: speed of rotation about x, y and z, see `Poses` [deg/s].
    right_m_per_s, up_m_per_s, back_m_per_s: speed along x, y and z [m/s].
    """

    tilt_deg_per_s: DegreesPerSecond = 0.0
    pan_deg_per_s: DegreesPerSecond = 0.0
    roll_deg_per_s: DegreesPerSecond = 0.0
    right_m_per_s: MetresPerSecond = 0.0
    up_m_per_s: MetresPerSecond = 0.0
    back_m_per_s: MetresPerSecond = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            key = name.rpartition("_per_s")[0].rpartition("_")[0]
            require(math.isfinite(value), f"motion.camera.{key}", value, "give a speed that is finite, such as 1 deg/s")

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s]."""
        turn = np.radians([self.tilt_deg_per_s, self.pan_deg_per_s, self.roll_deg_per_s])
        move = np.array([self.right_m_per_s, self.up_m_per_s, self.back_m_per_s])
        times_s = np.asarray(times_s, np.float64)[:, None]
        return Poses(turn * times_s, move * times_s)
