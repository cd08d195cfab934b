"""Photosites as areas, in float64: exact means of a scene of even square pixels, or of light between them, behind a lens.

The aperture is a disk or a convex polygon, cut into chords: along a chord the mean of the overlap of photosite and pixel has a
closed form. Chords of a disk are summed by the midpoint rule in the angle at which they begin, those of a polygon from corner
to corner.
"""

import math

import numpy as np

CHORDS = 256


def photosite_means(
    pixels: np.ndarray,
    shape: tuple[int, int],
    radius_px: float = 0.0,
    fill_factor: float = 1.0,
    chords: int = CHORDS,
    corners: np.ndarray | None = None,
    *,
    grid: tuple[float, float, float] | None = None,
    is_tent: bool = False,
) -> np.ndarray:
    """Mean of each photosite's open area, (..., rows, columns) float64, of a scene that covers the sensor, or of several.

    pixels: (..., height, width) radiance of even squares, 0 beyond them. shape: rows and columns of photosites. radius_px:
    signed blur radius [photosites]. corners: of the aperture, in order, (n, 2) [pupil radii]; None: a disk. grid: pixels per
    photosite and axis, and the row and column of the scene at which the first photosite begins; None: of a scene that covers
    the photosites. is_tent: whether light falls from the middle of each pixel to those of its neighbours.
    """
    scale, *first = grid or (pixels.shape[-1] / shape[1], 0.0, 0.0)
    side = math.sqrt(fill_factor)
    assert grid is not None or math.isclose(scale, pixels.shape[-2] / shape[0])

    def overlaps(axis: int, shift_px: float, half_chord_px: float) -> np.ndarray:
        shift = first[axis] + scale * shift_px
        return _overlaps(shape[axis], pixels.shape[axis - 2], scale, side, shift, scale * half_chord_px, is_tent=is_tent)

    if radius_px == 0.0:
        return overlaps(0, 0.0, 0.0) @ pixels @ overlaps(1, 0.0, 0.0).T
    means = np.zeros((*pixels.shape[:-2], *shape))
    for down, right, half, share in (_disk_chords(chords) if corners is None else _polygon_chords(corners, chords)).tolist():
        across = overlaps(1, radius_px * right, abs(radius_px) * half)
        means += share * (overlaps(0, radius_px * down, 0.0) @ pixels @ across.T)
    return means


def _disk_chords(count: int) -> np.ndarray:
    """Row, middle and half length of chords of the unit disk, and the share of its area that each stands for, (count, 4)."""
    angles = math.pi * ((np.arange(count) + 0.5) / count - 0.5)
    area = np.cos(angles) ** 2
    return np.stack([np.sin(angles), np.zeros(count), np.cos(angles), area / area.sum()], axis=-1)


def _polygon_chords(corners: np.ndarray, count: int) -> np.ndarray:
    """`_disk_chords` of a convex polygon, so many between the rows of one corner and those of the next."""
    rows = np.unique(corners[:, 1])
    y = (rows[:-1, None] + np.diff(rows)[:, None] * (np.arange(count) + 0.5) / count).ravel()
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    crosses = (y0 < y[:, None]) != (y1 < y[:, None])
    x = x0 + (x1 - x0) * (y[:, None] - y0) / np.where(y1 == y0, 1.0, y1 - y0)
    left, right = np.where(crosses, x, np.inf).min(axis=1), np.where(crosses, x, -np.inf).max(axis=1)
    area = (right - left) * np.repeat(np.diff(rows), count)
    return np.stack([y, 0.5 * (left + right), 0.5 * (right - left), area / area.sum()], axis=-1)


def means_behind_a_near_surface(
    near: np.ndarray, coverage: np.ndarray, back: np.ndarray, radius_px: float, samples: int
) -> np.ndarray:
    """Mean of each photosite that sees a sharp surface past one out of focus, (rows, columns) float64: F + B (1 - A).

    near, coverage, back: (height, width) even squares, `samples` per photosite and axis: radiance times coverage and coverage
    of the near surface, radiance of the sharp one, which is even within a square, so that means over squares multiply. The
    near surface is 0 beyond its squares. radius_px: blur radius of the near surface [photosites].
    """
    light, covered = (photosite_means(plane, plane.shape, samples * abs(radius_px), chords=64) for plane in (near, coverage))
    rows, columns = (side // samples for side in back.shape)
    return (light + back * (1.0 - covered)).reshape(rows, samples, columns, samples).mean(axis=(1, 3))


def means_of_upright_layers(colour: np.ndarray, coverage: np.ndarray, radius_px: np.ndarray, samples: int) -> np.ndarray:
    """Mean of each photosite that sees two surfaces out of focus, which vary along rows alone: (columns,) float64.

    The mean over the disk of F(x + s u) + B(x + t u) (1 - A(x + s u)), at chords of the disk and 32 points of each photosite.
    colour: (2, width) even squares, `samples` per photosite: radiance times coverage, nearest first. coverage: (width,), of the
    first. radius_px: (2,) signed blur radii s and t [photosites]. Beyond its squares a surface continues.
    """
    angles = math.pi * ((np.arange(8 * CHORDS) + 0.5) / (8 * CHORDS) - 0.5)
    shares = np.cos(angles) ** 2 / np.sum(np.cos(angles) ** 2)
    columns = coverage.size // samples
    places = (np.arange(32 * columns) + 0.5) / 32

    def pixel(moved_px: float) -> np.ndarray:
        return np.clip(np.floor(samples * (places + moved_px)).astype(int), 0, coverage.size - 1)

    near, through, back = colour[0].astype(np.float64), 1.0 - coverage, colour[1].astype(np.float64)
    light = np.zeros(places.size)
    for u, share in zip(np.sin(angles).tolist(), shares.tolist(), strict=True):
        first = pixel(float(radius_px[0]) * u)
        light += share * (near[first] + through[first] * back[pixel(float(radius_px[1]) * u)])
    return light.reshape(columns, 32).mean(axis=1)


def _overlaps(
    count: int, pixels: int, scale: float, side: float, shift: float, half_chord: float, *, is_tent: bool
) -> np.ndarray:
    """Share of each photosite's side on each pixel, (photosites, pixels), mean over shifts by up to half_chord [pixels].

    A side is the difference of its ends. So is a pixel, of a ramp; a tent is that of differences, of a parabola.
    """
    middle = scale * (np.arange(count) + 0.5)[:, None] + shift - np.arange(pixels)
    low, high = middle - 0.5 * scale * side, middle + 0.5 * scale * side
    ends = ((1.0, -0.5), (-2.0, 0.5), (1.0, 1.5)) if is_tent else ((1.0, 0.0), (-1.0, 1.0))
    ramp = _parabola if is_tent else _ramp
    found = sum(weight * (ramp(high - end, half_chord) - ramp(low - end, half_chord)) for weight, end in ends)
    return np.asarray(found / (scale * side))


def _ramp(place: np.ndarray, half: float) -> np.ndarray:
    """Mean of max(place + t, 0) over t from -half to half."""
    partly = np.maximum(place + half, 0.0) ** 2 / (4.0 * half) if half > 1e-30 else 0.0
    return np.where(np.abs(place) < half, partly, np.maximum(place, 0.0))


def _parabola(place: np.ndarray, half: float) -> np.ndarray:
    """Mean of max(place + t, 0)^2 / 2 over t from -half to half."""
    partly = np.maximum(place + half, 0.0) ** 3 / (12.0 * half) if half > 1e-30 else 0.0
    return np.where(np.abs(place) < half, partly, np.where(place > 0.0, 0.5 * place**2 + half**2 / 6.0, 0.0))


def fine_scene(kind: str, scale: float, shape: tuple[int, int], seed: int = 0) -> np.ndarray:
    """Scene of `scale` pixels per photosite, (height, width) radiance around 1 at most, but for lamps.

    kind: noise: independent pixels. edges: rectangles at any place and of any light. lamps: single pixels of 30 on 0.1.
    """
    rng = np.random.default_rng(seed)
    height, width = (round(scale * side) for side in shape)
    if kind == "noise":
        return rng.uniform(0.0, 1.0, (height, width))
    if kind == "lamps":
        return 0.1 + 30.0 * (rng.uniform(size=(height, width)) < 0.02 / scale**2)
    pixels = np.full((height, width), 0.5)
    for _ in range(60):
        y, x = rng.integers(0, height), rng.integers(0, width)
        pixels[y : y + rng.integers(2, height // 3), x : x + rng.integers(2, width // 3)] = rng.uniform()
    return pixels
