"""Weights of images of the clipped pupil, for many fields and radii at once: the area of each image in each photosite.

Every column of photosites is cut into slices. The mean upper and lower end of each part of the pupil (`Pupil.parts`) along a
slice has a closed form. The image of the intersection lies between the innermost of them. A photosite that an end divides gets
the share on the image's side.
"""

import math

import numpy as np

from simulator.optics.pupil.convex_area import Disk, HalfPlane
from simulator.optics.pupil.pupil import Pupil

SLICES = ((8.0, 64), (32.0, 32), (math.inf, 16))  # (largest radius [photosites], slices per photosite)
LEAST_PX = 0.25  # below it the image stays inside its photosite


def shape_weights(pupil: Pupil, fields: np.ndarray, radii_px: np.ndarray) -> np.ndarray:
    """Weights of the pupil's image at each field (n, 2) and signed radius (n,) [px]: (n, size, size) float64, sum 1 each.

    A photosite at x sees the point x + radius u through the place u of the pupil. size is odd and that of the largest radius.
    A pupil that is closed at a field gives zeros.
    """
    radii_px = np.where(np.abs(radii_px) < LEAST_PX, LEAST_PX, radii_px)
    size, slices = image_grid(pupil, float(np.abs(radii_px).max()))
    borders = np.linspace(0.0, size, size * slices + 1) - 0.5 * size
    low, high, inside = _ends(pupil, np.asarray(fields), radii_px[:, None], borders)
    low = np.clip(low + 0.5 * size, 0.0, size)
    high = np.maximum(np.clip(high + 0.5 * size, 0.0, size), low)
    steps = _steps(low, inside, slices, size) - _steps(high, inside, slices, size)
    weights = np.maximum(np.cumsum(steps, axis=2)[:, :, :size].transpose(0, 2, 1), 0.0)
    total = weights.sum(axis=(1, 2), keepdims=True)
    return weights / np.where(total > 0.0, total, 1.0)


def image_grid(pupil: Pupil, radius_px: float) -> tuple[int, int]:
    """Return the photosites per axis of an image of this radius [px], an odd number, and the slices of each column of them."""
    radius_px = max(abs(radius_px), LEAST_PX)
    slices = next(count for radius, count in SLICES if radius_px <= radius)
    return 2 * max(0, math.ceil(radius_px * pupil.corner_radius - 0.5)) + 1, slices


def _ends(
    pupil: Pupil, fields: np.ndarray, radii_px: np.ndarray, borders: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Upper and lower end of the image in each slice (n, slices), and the share of its width that the image covers."""
    shape = (len(radii_px), len(borders) - 1)
    low, high, inside = np.full(shape, -np.inf), np.full(shape, np.inf), np.ones(shape)
    moving = [(stop.shift * fields[:, :1], stop.shift * fields[:, 1:], stop.radius) for stop in pupil.stops]
    fixed = [(part.x, part.y, part.radius) for part in pupil.opening if isinstance(part, Disk)]
    for x, y, radius in fixed + moving:
        half = _mean_half_chord(borders - radii_px * x, np.abs(radii_px) * radius)
        low, high = np.maximum(low, radii_px * y - half), np.minimum(high, radii_px * y + half)
    for part in pupil.opening:
        if isinstance(part, HalfPlane):
            nx, ny, offset = part.nx * np.sign(radii_px), part.ny * np.sign(radii_px), part.offset * np.abs(radii_px)
            if abs(part.ny) < 1e-9:  # a vertical edge cuts within a slice
                covered = np.clip((offset - np.minimum(nx * borders[1:], nx * borders[:-1])) / np.diff(borders), 0.0, 1.0)
                inside *= covered
                continue
            end = (offset - nx * 0.5 * (borders[1:] + borders[:-1])) / ny
            low, high = np.where(ny < 0, np.maximum(low, end), low), np.where(ny > 0, np.minimum(high, end), high)
    return low, high, inside


def _mean_half_chord(borders: np.ndarray, radius: float | np.ndarray) -> np.ndarray:
    """Mean of sqrt(radius^2 - t^2), 0 outside the disk, over each slice: differences of its integral."""
    t = np.clip(borders, -radius, radius)
    integral = 0.5 * (t * np.sqrt(radius**2 - t**2) + radius**2 * np.arcsin(t / np.where(radius > 0, radius, 1.0)))
    return np.diff(integral, axis=1) / (borders[..., 1:2] - borders[..., :1])


def _steps(end: np.ndarray, inside: np.ndarray, slices: int, size: int) -> np.ndarray:
    """Change of the weights from row to row at these ends, (n, columns, size + 2); an end within a row is split between two."""
    rows = end.astype(np.int64)
    share = end - rows
    columns = np.arange(end.size).reshape(end.shape) // slices * (size + 2)
    places = (columns + rows).ravel()
    count = end.size // slices * (size + 2)
    changes = np.bincount(places, ((1.0 - share) * inside).ravel(), count) + np.bincount(
        places + 1, (share * inside).ravel(), count
    )
    return changes.reshape(len(end), size, size + 2)
