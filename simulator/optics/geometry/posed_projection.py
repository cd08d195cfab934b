"""The image of a scene at rest on a sensor whose places a motion has moved: poses of the projection at instants of a motion."""

from dataclasses import replace

import numpy as np

from simulator.optics.geometry.leaning_photosites import OF_TILT
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import Projection

SEEN_POSES = 33  # of many, whose largest stretch and lean are looked for
POSE_NUMBERS = 10  # of `pose_numbers`
TILT_SHARE = 0.2  # of the allowed error, for photosites that lean


def posed(projection: Projection, plan: MotionPlan, homography: np.ndarray, allowed: float = 0.0) -> Projection:
    """Return the projection of a scene at rest onto a sensor whose places are moved by a homography (3, 3).

    allowed: error, as a share of the brightest light, of which photosites have TILT_SHARE that are seen as upright rectangles:
    these leave OF_TILT t of random black and white pixels, of sides that lean by t of their length.
    """
    geometry = plan.path.motion.geometry
    tilt, stretch, extent = shape_of(homography, geometry.width_px, geometry.height_px)
    if projection.warp is not None:
        tilt += projection.warp.tilt(geometry.width_px, geometry.height_px)
    pose = tuple(pose_numbers(plan, homography).tolist())
    stretch, extent = projection.stretch * stretch, projection.extent * extent
    return replace(projection, pose=pose, stretch=stretch, extent=extent, leans=OF_TILT * tilt > TILT_SHARE * allowed)


def most_leaning(projection: Projection, plan: MotionPlan, allowed: float) -> Projection:
    """Return the projection `posed` at some instant of the path whose photosites lean, if any do, as work is counted by."""
    every = [posed(projection, plan, one, allowed) for one in _some(plan.path.motion.homographies(plan.path.poses, 0))]
    return max(every, key=lambda one: one.leans)


def _some(homographies: np.ndarray) -> np.ndarray:
    """Up to SEEN_POSES of homographies (..., 3, 3), the first and the last among them."""
    every = homographies.reshape(-1, 3, 3)
    return every[np.unique(np.linspace(0, len(every) - 1, SEEN_POSES).astype(int))]


def widest(projection: Projection, plan: MotionPlan, homographies: np.ndarray) -> Projection:
    """Return the projection for photosites that kernels move by any of homographies (..., 3, 3): of the largest stretch."""
    geometry = plan.path.motion.geometry
    shapes = [shape_of(one, geometry.width_px, geometry.height_px) for one in _some(homographies)]
    _, stretch, extent = (max(every) for every in zip(*shapes, strict=True))
    stretch, extent = projection.stretch * stretch, projection.extent * extent
    return replace(projection, pose=(0.0,) * POSE_NUMBERS, stretch=stretch, extent=extent)


def shape_of(homography: np.ndarray, width_px: float, height_px: float) -> tuple[float, float, float]:
    """Return the lean, the stretch and the extent of photosites: the most of each, somewhere on a sensor.

    How far a side leans and how long it is, and the width or height of the parallelogram, all over the side of a photosite.
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
    stretch, extent = (max(1.0, *(float(np.linalg.norm(one, norm, axis=1).max()) for one in ordered)) for norm in (2, 1))
    return tilt, stretch, extent


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
