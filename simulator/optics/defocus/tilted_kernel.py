"""Weights of the aperture's image on a tilted surface, whose blur radius varies across the image.

On a plane the signed radius is s(x + w) = s + g . w. The ray through the point u of the pupil meets it at x + w with
w = s(x + w) u, so w = s v with v = u / (1 - g . u): straight lines stay straight, and a round pupil becomes an ellipse whose
focus is the photosite and whose eccentricity is |g|. Uniform light on the pupil is distributed as du/dv = (1 + g . v)^-3.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.optics.defocus.photosite_area import FINEST, TILTED_IN_PARTS, WHOLE, PhotositeArea
from simulator.optics.pupil.pupil import Pupil

OUTLINE_POINTS = 1024  # vertices of the pupil's outline: a polygon within 1e-5 of its radius
SLICES = 256  # rows into which the image's radius is cut
MOST_SLICES = 64  # largest number of them in one sample
AT_ONCE = 2**17  # cells in slices that are computed together: about as many numbers as a core's own cache holds
STEP = 0.15  # largest relative change of the weight within one step down a column
STEPPED_PX = 4.0  # blur radius from which weights are rounded to steps [samples]
RADII = 5  # in a photosite for which images are made, on either side of the focus
NO_WEIGHT = 1e-13  # share of the largest weight that transforms leave of none


def tilted_weights(
    pupil: Pupil, radii_px: np.ndarray, slopes: np.ndarray, samples_per_axis: int, area: PhotositeArea = WHOLE
) -> list[np.ndarray]:
    """Weights of the samples of tilted planes that a photosite sees, (n, n) float64 each, sum 1, as `photosite_weights`.

    radii_px: (images,) signed radius at the photosite's centre [photosites]; each of its samples has its own. slopes:
    (images, 2) x, y of the radius [photosites per photosite], shorter than 1 / pupil.corner_radius.
    Inside the image, weights are rounded to steps down the columns, so that `make_taps` needs few taps. Columns step at
    different rows, and each keeps its sum and its centroid.
    A round pupil has no direction: images of mirrored slopes, and of radii of either sign, are mirror images of one another.
    The weights of an image do not depend on the others.
    """
    if not pupil.is_round:
        return _weights(pupil, radii_px, slopes, samples_per_axis, area)
    upright, index = np.unique(np.abs(np.column_stack([radii_px, slopes])), axis=0, return_inverse=True)
    weights = _weights(pupil, upright[:, 0], upright[:, 1:], samples_per_axis, area)
    steps = np.where((slopes < 0.0) != (radii_px < 0.0)[:, None], -1, 1).tolist()
    return [weights[n][::down, ::across] for n, (across, down) in zip(index.reshape(-1).tolist(), steps, strict=True)]


def _weights(
    pupil: Pupil, radii_px: np.ndarray, slopes: np.ndarray, samples_per_axis: int, area: PhotositeArea
) -> list[np.ndarray]:
    """`tilted_weights`, computed."""
    if not area.has_squares(samples_per_axis):
        return _gathered(pupil, radii_px, slopes, samples_per_axis, area)

    def weights(radius_px: float, slope: np.ndarray) -> np.ndarray:
        if abs(radius_px) * samples_per_axis < STEPPED_PX:
            return _weights_of_squares(pupil, radius_px, slope, samples_per_axis, area)

        def gather(radius_px: float, samples: int) -> np.ndarray:
            return _gathered(pupil, np.array([radius_px]), slope[None], samples, area)[0]

        return area.weights(gather, radius_px, samples_per_axis, least_parts=0.0)

    return [weights(*one) for one in zip(radii_px.tolist(), slopes, strict=True)]


def _weights_of_squares(
    pupil: Pupil, radius_px: float, slope: np.ndarray, samples_per_axis: int, area: PhotositeArea
) -> np.ndarray:
    """`tilted_weights` of even squares behind small circles, without steps: of their parts, at a few radii.

    Between these the images are linear, and between the focus and one part: light crosses borders in proportion to the radius.
    """
    parts = area.parts(max(abs(radius_px), 1.0 / FINEST), samples_per_axis, TILTED_IN_PARTS)
    samples = samples_per_axis * parts
    shares, radii = area.shares(samples), _radii_of_samples(np.array([radius_px]), slope[None], samples)[0]
    least, greatest = float(radii.min()), float(radii.max())
    before, behind = (
        np.linspace(max(end, 1.0), max(other, 1.0), RADII) for end, other in ((-least, -greatest), (least, greatest))
    )
    nodes = np.unique(np.concatenate([-before, np.zeros(1), behind, -np.ones(1), np.ones(1)]))
    near = [np.interp(radii, nodes, np.arange(len(nodes)) == number) for number in range(len(nodes))]
    used = [number for number, weights in enumerate(near) if weights.any()]
    slopes = np.repeat(slope[None], len(used), axis=0)
    reach = int(_reaches(pupil, np.array([[[max(-least, greatest, 1.0)]]]), slope[None])[0])
    images, _ = _cells(_Images.cut(pupil, nodes[used], slopes, np.full(len(used), reach)), np.arange(len(used)), reach)
    size, transformed = 2 * reach + samples, np.zeros(1, np.complex128)
    for image, number in zip(images, used, strict=True):
        own = near[number] * np.outer(shares, shares)
        transformed = transformed + np.fft.rfft2(image, (size, size)) * np.fft.rfft2(own, (size, size))
    spread = np.fft.irfft2(transformed, (size, size))
    spread[spread < NO_WEIGHT * spread.max()] = 0.0
    return area.add_parts(spread / spread.sum(), samples_per_axis, parts)


def _gathered(
    pupil: Pupil, radii_px: np.ndarray, slopes: np.ndarray, samples_per_axis: int, area: PhotositeArea
) -> list[np.ndarray]:
    """`tilted_weights` of samples that are values."""
    shares, radii = area.shares(samples_per_axis), _radii_of_samples(radii_px, slopes, samples_per_axis)
    reaches = _reaches(pupil, radii, slopes)
    samples = list(np.ndindex(samples_per_axis, samples_per_axis))
    images = [_Images.cut(pupil, radii[:, *sample], slopes, reaches) for sample in samples]
    steepest = np.maximum(3.0 * np.abs(slopes[:, 1]), 1e-9)
    rows = np.floor(samples_per_axis * np.abs(radii_px) * np.minimum(STEP / steepest, 0.5)).astype(int)
    weights: list[np.ndarray] = [np.empty(0)] * len(radii_px)
    for reach in np.unique(reaches).tolist():
        some = np.flatnonzero(reaches == reach)
        size = 2 * reach + samples_per_axis
        spread, inside = np.zeros((2, len(some), size, size))
        for (y, x), of_sample in zip(samples, images, strict=True):
            light, covered = _cells(of_sample, some, reach)
            here = np.s_[:, y : y + 2 * reach + 1, x : x + 2 * reach + 1]
            spread[here] += light * (shares[y] * shares[x])
            inside[here] += covered
        totals, long = _sums(spread), rows[some] >= 2
        spread[long] = _in_steps(spread[long], inside[long] > samples_per_axis**2 - 1e-6, rows[some][long])
        spread /= totals
        for place, image in zip(some.tolist(), spread, strict=True):
            weights[place] = image
    return weights


def _radii_of_samples(radii_px: np.ndarray, slopes: np.ndarray, samples_per_axis: int) -> np.ndarray:
    """Signed radii at the samples of a photosite, (images, n, n) [samples]."""
    across, down = slopes.T[:, :, None, None]
    places = np.arange(samples_per_axis) - 0.5 * (samples_per_axis - 1)
    return np.asarray(samples_per_axis * radii_px[:, None, None] + across * places + down * places[:, None])


def _reaches(pupil: Pupil, radii: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Samples beside their own that images of these radii (images, n, n) reach on either side, (images,)."""
    corner = pupil.corner_radius
    farthest = np.abs(radii).max(axis=(1, 2)) * corner / (1.0 - np.hypot(*slopes.T) * corner)
    return np.maximum(np.ceil(farthest - 0.5), 0.0).astype(int)


def _sums(images: np.ndarray) -> np.ndarray:
    """Sum of each image (images, n, n): (images, 1, 1)."""
    return images.reshape(len(images), -1).sum(axis=1)[:, None, None]


@dataclass(frozen=True)
class _Images:
    """Images of the aperture on a grid of cells, cut into rows.

    radii: (images,) [samples]. slopes: (images, 2). slices: (images,) rows of each cell; 0: the image stays in one cell.
    first: (images,) place of an image's first row in low and high: left and right end of its rows [radii], both 0 outside.
    """

    radii: np.ndarray
    slopes: np.ndarray
    slices: np.ndarray
    first: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @staticmethod
    def cut(pupil: Pupil, radii: np.ndarray, slopes: np.ndarray, reaches: np.ndarray) -> "_Images":
        """Cut images that reach so many cells, (images,), to each side."""
        one_cell = np.abs(radii) * pupil.corner_radius <= 0.5 * (1.0 - np.hypot(*slopes.T))
        slices = np.minimum(np.ceil(SLICES / np.where(one_cell, 1.0, np.abs(radii))), MOST_SLICES).astype(int)
        slices[one_cell] = 0
        order, counts = np.lexsort(slopes.T), (2 * reaches + 1) * slices
        ends = np.cumsum(counts[order])
        first = np.empty_like(ends)
        first[order] = ends - counts[order]
        every = np.repeat(order, counts[order])
        row = np.arange(len(every)) - first[every]
        rows = ((row + 0.5) / slices[every] - reaches[every] - 0.5) / radii[every]
        low, high = np.empty((2, len(rows)))
        kinds = np.flatnonzero((np.diff(slopes[order], axis=0) != 0.0).any(axis=1)) + 1
        for own in np.split(order, kinds) if len(order) else ():  # images of one slope
            here = slice(first[own[0]], first[own[-1]] + counts[own[-1]])
            for places, (x, y) in zip((low, high), _sides(pupil, tuple(slopes[own[0]].tolist())), strict=True):
                places[here] = np.interp(rows[here], y, x, left=0.0, right=0.0)
        return _Images(radii, slopes, slices, first, low, high)


def _cells(images: _Images, some: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Weight of each sample's cell around a sample, sum 1, and the share of the cell inside the image.

    some: numbers of the images. Both results are (images, 2 reach + 1, 2 reach + 1).
    """
    size, slices = 2 * reach + 1, images.slices[some]
    light, inside = np.zeros((2, len(some), size, size))
    light[slices == 0, reach, reach] = inside[slices == 0, reach, reach] = 1.0
    for count in np.unique(slices[slices > 0]).tolist():
        same, at_once = np.flatnonzero(slices == count), max(1, AT_ONCE // (size**2 * count))
        for part in np.split(same, range(at_once, len(same), at_once)):
            light[part], inside[part] = _add_slices(images, some[part], reach, count)
    return light, inside


def _add_slices(images: _Images, some: np.ndarray, reach: int, slices: int) -> tuple[np.ndarray, np.ndarray]:
    """`_cells` of images that are cut into so many slices per cell. Arrays are (columns, slices, images and rows of cells)."""
    size, radii = 2 * reach + 1, images.radii[some, None]
    across, down = (np.repeat(slope, size) for slope in images.slopes[some].T)
    rows = (np.arange(size * slices) + 0.5) / slices - reach - 0.5
    places = images.first[some, None] + np.arange(size * slices)
    low, high, rows = (part.reshape(-1, slices).T for part in (images.low[places], images.high[places], rows / radii))
    borders = np.repeat(((np.arange(size + 1) - reach - 0.5) / radii).T, size, axis=1)[:, None]
    borders = np.clip(borders, low.copy(), high.copy())
    lengths = np.diff(borders, axis=0)
    np.abs(lengths, out=lengths)
    borders *= across
    borders += 1.0 + down * rows
    left, right = borders[:-1], borders[1:]
    both = left * right
    both *= both
    light = left + right
    light *= lengths
    light /= both  # twice the integral of stretch^-3
    light, lengths = (part.sum(axis=1).reshape(size, -1, size).transpose(1, 2, 0).copy() for part in (light, lengths))
    return light / _sums(light), lengths * np.abs(radii)[:, :, None] / slices


@lru_cache(maxsize=16)
def _sides(pupil: Pupil, slope: tuple[float, float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Places (x, y) of the left and of the right side of the pupil's image v, from top to bottom."""
    edge = _outline(pupil)
    edge = edge / (1.0 - edge @ slope)[:, None]
    edge = np.roll(edge, -int(edge[:, 1].argmin()), axis=0)
    bottom = int(edge[:, 1].argmax())
    right, left = edge[: bottom + 1], np.concatenate([edge[bottom:], edge[:1]])[::-1]
    return [(np.ascontiguousarray(chain[:, 0]), np.ascontiguousarray(chain[:, 1])) for chain in (left, right)]


@lru_cache
def _outline(pupil: Pupil) -> np.ndarray:
    """Outline of the pupil with about OUTLINE_POINTS vertices."""
    outline = pupil.outline()
    return outline[:: max(1, len(outline) // OUTLINE_POINTS)]


def _in_steps(weights: np.ndarray, inside: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Round weights (images, n, n) inside the images to steps of rows (images,), which begin at another row in each column.

    The sum and the centroid of each column are kept; a column too short for that is not changed.
    """
    size = weights.shape[-1]
    row, column = np.arange(size)[:, None], np.arange(size)
    step = rows[:, None, None]
    offsets = np.floor(step * np.mod(0.5 * (math.sqrt(5.0) - 1.0) * column, 1.0)).astype(int)
    steps = _means(weights, inside, (row + offsets) // step)
    mean = _means(weights, inside, np.zeros((1, 1, 1), int))
    exact, stepped = ((inside * (part - mean) * row).sum(axis=1, keepdims=True) for part in (weights, steps))
    long = np.abs(stepped) > 0.5 * np.abs(exact)
    lift = exact / np.where(long, stepped, 1.0)
    return np.where(inside & long, mean + lift * (steps - mean), weights)


def _means(weights: np.ndarray, inside: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Mean of weights (images, n, n) inside the images over each part of each column. parts: number of each weight's part."""
    images, size, _ = weights.shape
    count = int(parts.max(initial=0)) + 1
    groups = (np.arange(images)[:, None, None] * count + parts) * size + np.arange(size)
    groups = np.broadcast_to(groups, weights.shape)
    number = np.bincount(groups[inside], minlength=images * count * size)
    total = np.bincount(groups[inside], weights[inside], minlength=images * count * size)
    return (total / np.maximum(number, 1))[groups]
