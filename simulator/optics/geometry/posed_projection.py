"""The image of a scene at rest on a sensor whose places a motion has moved: poses of the projection at instants of a motion."""

from dataclasses import replace

import numpy as np

from simulator.optics.geometry.leaning_photosites import OF_TILT
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import TILTED_PARTS, Projection

SEEN_POSES = 33  # of many, whose largest stretch and parts are looked for
POSE_NUMBERS = 10  # of `pose_numbers`
TILT_SHARE = 0.2  # of the allowed error, for photosites that lean
TILT_PARTS = 1, 2, TILTED_PARTS  # upright parts per axis that these may have


def posed(projection: Projection, plan: MotionPlan, homography: np.ndarray, allowed: float = 0.0) -> Projection:
    """Return the projection of a scene at rest onto a sensor whose places are moved by a homography (3, 3).

    allowed: error, as a share of the brightest light, of which photosites have TILT_SHARE that are seen in as few upright parts
    as do: n x n parts leave OF_TILT t / n^2 of random black and white pixels, of sides that lean by t of their length.
    """
    geometry = plan.path.motion.geometry
    tilt, stretch = shape_of(homography, geometry.width_px, geometry.height_px)
    if projection.warp is not None:
        tilt += projection.warp.tilt(geometry.width_px, geometry.height_px)
    parts = next((n for n in TILT_PARTS if OF_TILT * tilt <= n**2 * TILT_SHARE * allowed), TILT_PARTS[-1])
    pose = tuple(pose_numbers(plan, homography).tolist())
    return replace(projection, pose=pose, stretch=projection.stretch * stretch, tilted_parts=parts)


def most_parted(projection: Projection, plan: MotionPlan, allowed: float) -> Projection:
    """Return the projection `posed` at some instant of the path whose photosites have the most parts, as work is counted by."""
    every = [posed(projection, plan, one, allowed) for one in _some(plan.path.motion.homographies(plan.path.poses, 0))]
    return max(every, key=lambda one: one.tilted_parts)


def _some(homographies: np.ndarray) -> np.ndarray:
    """Up to SEEN_POSES of homographies (..., 3, 3), the first and the last among them."""
    every = homographies.reshape(-1, 3, 3)
    return every[np.unique(np.linspace(0, len(every) - 1, SEEN_POSES).astype(int))]


def widest(projection: Projection, plan: MotionPlan, homographies: np.ndarray) -> Projection:
    """Return the projection for photosites that kernels move by any of homographies (..., 3, 3): of the largest stretch."""
    geometry = plan.path.motion.geometry
    stretch = max(shape_of(one, geometry.width_px, geometry.height_px)[1] for one in _some(homographies))
    return replace(projection, pose=(0.0,) * POSE_NUMBERS, stretch=projection.stretch * stretch)


def shape_of(homography: np.ndarray, width_px: float, height_px: float) -> tuple[float, float]:
    """Return how far sides of photosites lean, in their length, and how far they are stretched at most, somewhere on a sensor.

    homography: (3, 3) of places from its middle. The side that leans less counts, as one of a photosite that is turned over.
    """
    ends = (-0.55, 0.0, 0.55)  # also beyond the sensor, where light beside it is read
    places = np.array([(x * width_px, y * height_px, 1.0) for x in ends for y in ends])
    found = places @ homography.T
    depth = found[:, 2, None]
    across, down = (
        (homography[axis, :2] - found[:, axis, None] / depth * homography[2, :2]) / depth for axis in (0, 1)
    )  # changes of x and of y by a photosite to the right and down
    ordered = [np.sort(np.abs(one), axis=1) for one in (across, down)]
    tilt = max(float((one[:, 0] / np.maximum(one[:, 1], 1e-12)).max()) for one in ordered)
    return tilt, max(1.0, *(float(np.hypot(*one.T).max()) for one in ordered))


def pose_numbers(plan: MotionPlan, homographies: np.ndarray) -> np.ndarray:
    """Return pivot and displacement of homographies (..., 3, 3), as kernels/scene_place.h has them: (..., 10) float64."""
    geometry, h = plan.path.motion.geometry, homographies
    x, y = (np.full(h.shape[:-2], 0.5 * side) for side in (geometry.width_px, geometry.height_px))
    across = h[..., 0, 2], h[..., 0, 0] - 1.0, h[..., 0, 1]
    down = h[..., 1, 2], h[..., 1, 0], h[..., 1, 1] - 1.0
    return np.stack([x, y, *across, *down, h[..., 2, 0], h[..., 2, 1]], axis=-1)


def row_views(plan: MotionPlan, homographies: np.ndarray, y_px: np.ndarray) -> dict[str, np.ndarray]:
    """Return the displacement over rows of the sensor at their instants, fields of `struct view` (kernels/swept_area.h).

    homographies: (rows or 1, instants, 3, 3). y_px: (rows,) of the rows' middles from the sensor's corner [photosites]. Each
    field is (rows, instants) float64.
    """
    y = (y_px - 0.5 * plan.path.motion.geometry.height_px)[:, None]
    numbers = np.moveaxis(pose_numbers(plan, homographies)[..., 2:], -1, 0)
    x0, xx, xy, y0, yx, yy, right, down = numbers
    along = 1.0 + down * y
    return {
        "x": (x0 + xy * y) / along,
        "x_slope": (xx - down * y) / along,
        "y": (y0 + yy * y - down * y**2) / along,
        "y_slope": (yx - right * y) / along,
        "shrink": right / along,
    }
