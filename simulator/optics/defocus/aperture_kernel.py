"""The point spread function of defocus as photosite weights, and the taps with which a kernel sums it quickly.

The image of a defocused point is the shape of the aperture, scaled to the blur circle. The weight of a photosite is the exact
area of the shape inside its square (of 1 px), divided by the sum of all weights.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from simulator.optics.defocus.blade_kernel import blade_weights
from simulator.optics.defocus.clipped_kernel import image_grid, shape_weights
from simulator.optics.defocus.path_weights import path_weights
from simulator.optics.defocus.photosite_area import FINEST, WHOLE, PhotositeArea
from simulator.optics.defocus.square_kernel import disk_square_weights
from simulator.optics.pupil.pupil import Pupil

MOST_AT_ONCE, MOST_WEIGHTS = 16, 4e6  # largest batch of images of the clipped aperture: images, and weights
DIRECT = 49  # most weights of a kernel for which reading samples needs no more reads than reading running sums
CHUNK = 8  # taps that kernels/defocus.cl adds up at a time


def disk_weights(radius_px: float) -> np.ndarray:
    """Weights of a disk centred on a photosite: (2 n + 1, 2 n + 1) float64, sum 1; [[1]] where the disk fits in the photosite.

    The areas are exact: second differences of F(x, y), the area of the part of the disk left of x and above y.
    """
    radius_px = abs(radius_px)
    if radius_px <= 0.5:
        return np.ones((1, 1))
    reach = math.ceil(radius_px - 0.5)
    borders = np.maximum(np.arange(reach + 2) - 0.5, 0.0)  # of a quarter, in which the middle photosites are halved
    area = _corner_area(borders[None, :], borders[:, None], radius_px)
    quarter = np.maximum(np.diff(np.diff(area, axis=0), axis=1), 0.0)
    quarter[0] *= 2.0
    quarter[:, 0] *= 2.0
    mirrored = np.abs(np.arange(-reach, reach + 1))
    weights = quarter[mirrored[:, None], mirrored]
    return weights / weights.sum()


def disk_shares(x: np.ndarray, y: np.ndarray, radius_px: float, width_px: int) -> np.ndarray:
    """Share of a disk about the origin in squares of this whole width, exact: (len(y) - width_px, len(x) - width_px) float64.

    x, y: evenly spaced borders [px], 1 / width_px of a square apart, so that square i lies between borders i and i + width_px.
    """
    area = _corner_area(x[None, :], y[:, None], abs(radius_px))
    strips = area[width_px:] - area[:-width_px]
    return np.maximum(strips[:, width_px:] - strips[:, :-width_px], 0.0) / (math.pi * radius_px**2)


def aperture_weights(pupil: Pupil, radius_px: float) -> np.ndarray:
    """Weights of the aperture's image of this signed radius [px] on the axis, (2 n + 1, 2 n + 1) float64, sum 1.

    A photosite at x sees the point x + radius u through the point u of the pupil (`Pupil`).
    """
    if pupil.is_round:
        return disk_weights(radius_px)
    if abs(radius_px) * pupil.corner_radius <= 0.5:
        return np.ones((1, 1))
    return blade_weights(pupil, radius_px, 1)


def photosite_weights(pupil: Pupil, radius_px: float, samples_per_axis: int, area: PhotositeArea = WHOLE) -> np.ndarray:
    """Weights of the samples that a photosite sees through the aperture: (n, n) float64, sum 1.

    radius_px: signed blur radius [photosites]. samples_per_axis: samples per photosite and axis. The weights are the
    aperture's image on the grid of samples, averaged over the photosite's own samples; where samples are even squares, exact.
    n is odd where samples_per_axis is; where n is even, the photosite's centre lies between the middle ones.
    """

    def gather(radius_px: float, samples: int) -> np.ndarray:
        return area.mean(aperture_weights(pupil, samples * radius_px), samples)

    if (path := area.path_behind(radius_px, samples_per_axis)) is not None:
        return path_weights(partial(aperture_weights, pupil), radius_px, path)
    if area.has_squares(samples_per_axis) and radius_px != 0.0:
        if pupil.is_round:
            return disk_square_weights(radius_px, samples_per_axis, area.open_side)
        return blade_weights(pupil, samples_per_axis * radius_px, samples_per_axis, samples_per_axis * area.open_side)
    return area.weights(gather, radius_px, samples_per_axis)


def clipped_weights(
    pupil: Pupil, fields: np.ndarray, radii_px: np.ndarray, samples_per_axis: int, area: PhotositeArea = WHOLE
) -> list[np.ndarray]:
    """`photosite_weights` of the pupil as its stops clip it, for each field (n, 2) and its signed radius (n,) [photosites].

    Images on grids of one size are computed together, so that those of a field and radius do not depend on the others.
    """
    weights = [np.empty(0)] * len(radii_px)
    radii, index = np.unique(np.abs(radii_px), return_inverse=True)
    grids = [_clipped_grid(pupil, radius, samples_per_axis, area) for radius in radii.tolist()]
    for kind in sorted(set(grids)):
        order = np.flatnonzero(np.array([grid == kind for grid in grids])[index.reshape(-1)])
        batch = max(1, min(MOST_AT_ONCE, int(MOST_WEIGHTS / kind[0] ** 2)))
        for start in range(0, len(order), batch):
            some = order[start : start + batch]

            def gather(_: float, samples: int, some: np.ndarray = some) -> np.ndarray:
                return area.mean(shape_weights(pupil, fields[some], samples * radii_px[some]), samples)

            images = area.weights(gather, _not_sharp(np.abs(radii_px[some]).min()), samples_per_axis)
            for place, image in zip(some, images, strict=True):
                weights[place] = image
    return weights


def clipped_work(pupil: Pupil, radius_px: float, samples_per_axis: int, area: PhotositeArea) -> dict[str, float]:
    """Work of one image of `clipped_weights`: slices that are cut, products that are added up, and weights that are made."""
    size, slices, parts = _clipped_grid(pupil, abs(radius_px), samples_per_axis, area)
    samples = samples_per_axis * parts
    whole, open_ = size + samples - 1, np.count_nonzero(area.shares(samples))
    return {"slices": float(size * slices), "products": float(open_ * size * (size + whole)), "weights": float(whole**2)}


def _clipped_grid(pupil: Pupil, radius_px: float, samples_per_axis: int, area: PhotositeArea) -> tuple[int, int, int]:
    """Weights per axis and slices of a clipped image of this radius [photosites], and the parts of each sample."""
    parts = area.parts(_not_sharp(radius_px), samples_per_axis)
    return *image_grid(pupil, samples_per_axis * parts * radius_px), parts


def _not_sharp(radius_px: float) -> float:
    """Radius by which the parts of a sample are chosen [photosites]: clipped images are not interpolated towards none."""
    return max(float(radius_px), 1.0 / FINEST)


def _corner_area(x: np.ndarray, y: np.ndarray, radius: float) -> np.ndarray:
    """Area of the part of a disk about the origin whose coordinates are below x and y."""
    corner = np.sqrt(np.maximum(radius**2 - y**2, 0.0))  # half of the chord that the line y cuts from the disk
    # The integral grows with its end, so that it is taken of each x and y once: that to the lesser end is the lesser integral.
    to_x, to_corner, whole = _half_segment(x, radius), _half_segment(corner, radius), _half_segment(radius, radius)
    to_left, to_right = np.minimum(to_x, -to_corner), np.minimum(to_x, to_corner)
    outer = to_left + whole + np.maximum(to_x - to_corner, 0.0)
    inner = y * np.maximum(np.minimum(x, corner) + corner, 0.0) + to_right - to_left
    return np.where(y > 0, 2.0 * outer, 0.0) + np.where(np.abs(y) < radius, inner, 0.0)


def _half_segment(t: float | np.ndarray, radius: float) -> np.ndarray:
    """Integral of sqrt(radius^2 - t^2) from 0 to t; t is clipped to the disk."""
    t = np.clip(t, -radius, radius)
    return 0.5 * (t * np.sqrt(np.maximum(radius**2 - t**2, 0.0)) + radius**2 * np.arcsin(t / radius))


@dataclass(frozen=True)
class Taps:
    """Reads (taps) whose weighted sum is a weighted sum over an area: of samples, or of prefix sums down the columns.

    rows, columns: (taps,) offsets [samples] from the photosite's first sample to the sample or prefix sum that is read; a
        prefix sum holds all samples above it in its column. weights: (taps,) factor of each sample, or of what a prefix sum
        has more than the one read before; in chunks of CHUNK, of which the first has none.
    direct: whether samples are read instead of prefix sums.
    """

    rows: np.ndarray
    columns: np.ndarray
    weights: np.ndarray
    direct: bool = False


def make_taps(images: Sequence[np.ndarray], samples_per_axis: int = 1, direct: int = DIRECT) -> list[Taps]:
    """Taps of kernels (n, n): a prefix sum is read wherever the weight changes down a column.

    The photosite's own samples lie in the middle of a kernel; the first is element (n - samples_per_axis) // 2 of each axis.

    The sum over w[i] v[i] is the sum over w (S[b] - S[a]) of the parts a to b of a column of one weight w, S[i] = v[0] + ... +
    v[i - 1]. Where nothing is added between a and b, the difference is exactly 0, however large the sums are. An evenly
    bright aperture has only one such part per column, so that the work grows with the radius instead of its square.
    A small kernel reads the samples themselves: as quick, and without the rounding errors of prefix sums beside highlights.
    direct: number of weights of the largest kernel that reads samples.
    """
    taps: dict[int, Taps] = {}
    sizes = np.array([len(image) for image in images])
    for size in np.unique(sizes).tolist():
        same = np.flatnonzero(sizes == size).tolist()
        taps |= zip(same, _taps_of(np.stack([images[n] for n in same]), samples_per_axis, direct), strict=True)
    return [taps[n] for n in range(len(images))]


def _taps_of(weights: np.ndarray, samples_per_axis: int, direct: int) -> Iterator[Taps]:
    """`make_taps` of kernels of one size, (images, n, n)."""
    images, size, _ = weights.shape
    reach, is_direct = (size - samples_per_axis) // 2, size**2 <= direct
    if is_direct:
        image, rows, columns = np.nonzero(weights)
        read = weights[image, rows, columns]
    else:
        steps = np.diff(weights, axis=1, prepend=0.0, append=0.0)
        image, columns, rows = np.nonzero(np.abs(steps.transpose(0, 2, 1)) > 1e-12)
        goes_on = (np.diff(image, prepend=-1) == 0) & (np.diff(columns, prepend=-1) == 0)
        read = np.where(goes_on, weights[image, rows - 1, columns], 0.0)
    rows, columns = rows - reach, columns - reach
    ends = np.searchsorted(image, np.arange(images + 1)).tolist()
    for begin, end in pairwise(ends):
        own = np.arange(begin, end) if is_direct else begin + _overlapping_chunks(end - begin)
        factors = read[own] if is_direct else np.where(np.arange(len(own)) % CHUNK, read[own], 0.0)
        yield Taps(rows[own], columns[own], factors, is_direct)


def _overlapping_chunks(count: int) -> np.ndarray:
    """Numbers below `count` in chunks that begin with the last number of the one before, so that no difference is missing."""
    chunks = max(-(-(count - 1) // (CHUNK - 1)), 1)
    numbers = (CHUNK - 1) * np.arange(chunks)[:, None] + np.arange(CHUNK)
    return numbers[numbers < count]
