"""Photosites as areas, in float64: exact means of a scene of even square pixels behind a lens out of focus.

The aperture is a disk, cut into chords: along a chord the mean of the overlap of photosite and pixel has a closed form, and the
chords are summed by the midpoint rule in the angle at which they begin.
"""

import math

import numpy as np

CHORDS = 256


def photosite_means(
    pixels: np.ndarray, shape: tuple[int, int], radius_px: float = 0.0, fill_factor: float = 1.0, chords: int = CHORDS
) -> np.ndarray:
    """Mean of each photosite's open area, (rows, columns) float64, of a scene that covers the sensor.

    pixels: (height, width) radiance of even squares, 0 beyond them; as many per photosite in y as in x. shape: rows and columns
    of photosites. radius_px: blur radius [photosites].
    """
    scale, side = pixels.shape[1] / shape[1], math.sqrt(fill_factor)
    assert math.isclose(scale, pixels.shape[0] / shape[0])

    def overlaps(axis: int, shift_px: float, half_chord_px: float) -> np.ndarray:
        return _overlaps(shape[axis], pixels.shape[axis], scale, side, scale * shift_px, scale * half_chord_px)

    if radius_px == 0.0:
        return overlaps(0, 0.0, 0.0) @ pixels @ overlaps(1, 0.0, 0.0).T
    angles = math.pi * ((np.arange(chords) + 0.5) / chords - 0.5)
    shares = np.cos(angles) ** 2 / np.sum(np.cos(angles) ** 2)
    means = np.zeros(shape)
    for angle, share in zip(angles.tolist(), shares.tolist(), strict=True):
        across = overlaps(1, 0.0, radius_px * math.cos(angle))
        means += share * (overlaps(0, radius_px * math.sin(angle), 0.0) @ pixels @ across.T)
    return means


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


def _overlaps(count: int, pixels: int, scale: float, side: float, shift: float, half_chord: float) -> np.ndarray:
    """Share of each photosite's side on each pixel, (photosites, pixels), mean over shifts by up to half_chord [pixels]."""
    middle = scale * (np.arange(count) + 0.5)[:, None] + shift - np.arange(pixels)
    low, high = middle - 0.5 * scale * side, middle + 0.5 * scale * side
    return (_ramp(high, half_chord) - _ramp(high - 1, half_chord) - _ramp(low, half_chord) + _ramp(low - 1, half_chord)) / (
        scale * side
    )


def _ramp(place: np.ndarray, half: float) -> np.ndarray:
    """Mean of max(place + t, 0) over t from -half to half."""
    partly = np.maximum(place + half, 0.0) ** 2 / (4.0 * half) if half > 1e-30 else 0.0
    return np.where(np.abs(place) < half, partly, np.maximum(place, 0.0))


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
