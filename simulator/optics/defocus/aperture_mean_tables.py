"""Tables of kernels/defocus.cl: for each blur radius, the taps whose weighted sum is the mean over the aperture's image."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.device.threads import THREADS, in_threads
from simulator.optics.defocus.aperture_kernel import CHUNK, MOST_WEIGHTS, Taps, make_taps, photosite_weights
from simulator.optics.defocus.photosite_area import WHOLE, PhotositeArea
from simulator.optics.defocus.tilted_kernel import tilted_weights
from simulator.optics.geometry.interleaved_columns import InterleavedColumns, element
from simulator.optics.pupil.pupil import Pupil

LEAST_WEIGHTS = 100_000  # that are worth several threads
MOST_KEPT = 4096  # images of a pupil whose taps are kept for the next frame

_Key = tuple[float, tuple[float, float]]  # radius and slope of an image


@dataclass(frozen=True)
class Image:
    """An image of the aperture: signed blur radius [photosites], and slope of the radius in x and y [photosites per photosite].

    node: number of the tabulated radius, where the mean is interpolated between radii.
    """

    radius_px: float
    slope: tuple[float, float] = (0.0, 0.0)
    node: int = 0


@dataclass(frozen=True)
class BlurTable:
    """Nodes and taps of images of the aperture, one node each, as kernels/aperture_mean.h declares them.

    nodes: (nodes,) of `struct node`. taps: (taps,) of `struct tap`.
    """

    nodes: np.ndarray
    taps: np.ndarray


def aperture_taps(pupil: Pupil, images: Sequence[Image], samples_per_axis: int, area: PhotositeArea = WHOLE) -> list[Taps]:
    """Taps of the aperture's images on the optical axis, for surfaces of their slopes. Those of the last images are kept."""
    known = _known_taps(pupil, samples_per_axis, area)
    keys = [(image.radius_px, image.slope) for image in images]
    found = {key: taps for key in keys if (taps := known.get(key)) is not None}
    batches = list(_batches({*keys} - found.keys(), samples_per_axis))

    def make(some: list[_Key]) -> list[Taps]:
        return make_taps(_weights(pupil, some, samples_per_axis, area), samples_per_axis)

    made = {
        key: taps
        for some, own in zip(batches, in_threads(make, batches), strict=True)
        for key, taps in zip(some, own, strict=True)
    }
    if len(known) + len(made) > MOST_KEPT:
        known.clear()
    known.update(made)
    found |= made
    return [found[key] for key in keys]


def _batches(images: Iterable[_Key], samples_per_axis: int) -> Iterator[list[_Key]]:
    """Split images into those whose weights are computed together: mirrored ones, and others of about their size.

    They are so many that each thread has a part, and so few that all fit into memory.
    """
    batch: list[_Key] = []
    weights, sizes = 0.0, {image: (samples_per_axis * (2.0 * abs(image[0]) + 1.0)) ** 2 for image in images}
    most = min(MOST_WEIGHTS, max(sum(sizes.values()), LEAST_WEIGHTS)) / THREADS
    for image in sorted(images, key=lambda image: (abs(image[0]), *map(abs, image[1]))):
        own = sizes[image]
        if batch and weights + own > most:
            yield batch
            batch, weights = [], 0.0
        batch.append(image)
        weights += own
    if batch:
        yield batch


@lru_cache(maxsize=4)
def _known_taps(pupil: Pupil, samples_per_axis: int, area: PhotositeArea) -> dict[_Key, Taps]:
    """Taps by radius and slope."""
    return {}


def _weights(pupil: Pupil, images: list[_Key], samples_per_axis: int, area: PhotositeArea) -> list[np.ndarray]:
    """Weights of the samples that a photosite sees, (n, n) of each image, given as its radius and slope."""
    tilted = [n for n, (_, slope) in enumerate(images) if any(slope)]
    weights = {n: photosite_weights(pupil, images[n][0], samples_per_axis, area) for n in set(range(len(images))) - set(tilted)}
    radii_px, slopes = np.array([images[n][0] for n in tilted]), np.array([images[n][1] for n in tilted]).reshape(-1, 2)
    weights |= zip(tilted, tilted_weights(pupil, radii_px, slopes, samples_per_axis, area), strict=True)
    return [weights[n] for n in range(len(images))]


def blur_table(images: Sequence[Taps], numbers: Sequence[int], layout: InterleavedColumns) -> BlurTable:
    """Table of these images.

    numbers: `Image.node` of each. layout: of the samples of a band.
    """
    # A plane of prefix sums has a row more than one of samples: the sum of all rows.
    parts = [(image.rows, image.columns, image.weights, layout.rows + (not image.direct)) for image in images]
    counts = np.array([-(-len(part[0]) // CHUNK) * CHUNK for part in parts])
    nodes = np.zeros(len(images), declared_struct(kernel_source("aperture_mean.h"), "node"))
    nodes["first_tap"], nodes["taps"] = np.cumsum(counts) - counts, counts
    nodes["radius"], nodes["direct"] = numbers, [image.direct for image in images]
    return BlurTable(nodes, _taps(parts, counts, layout))


def _taps(
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray, int]], counts: np.ndarray, layout: InterleavedColumns
) -> np.ndarray:
    """Taps (taps,) of `struct tap`.

    parts: row and column offsets from the photosite's first sample, weights, and rows of the plane that is read.
    counts: taps of each part, including the taps of weight 0 that pad it to whole chunks. layout: of the samples.
    """
    taps = np.zeros(int(counts.sum()) + CHUNK, declared_struct(kernel_source("aperture_mean.h"), "tap"))  # no buffer is empty
    down, right = _padded([part[0] for part in parts]), _padded([part[1] for part in parts])
    height = np.repeat([*(part[3] for part in parts), 0], [*counts, CHUNK])
    for parity in (0, 1):
        taps["offset"][:, parity] = element(0, down, layout.over * parity + right, layout.over, height, layout.set_columns)
    taps["weight"] = _padded([part[2] for part in parts])
    return taps


def _padded(parts: list[np.ndarray]) -> np.ndarray:
    """Concatenate all parts, each padded with zeros to whole chunks, and append a chunk of zeros."""
    lengths = np.array([len(part) for part in parts])
    room = -(-lengths // CHUNK) * CHUNK
    shift = np.repeat(np.cumsum(room - lengths) - (room - lengths), lengths)  # zeros before each value
    filled = np.zeros(int(room.sum()) + CHUNK, parts[0].dtype)
    filled[np.arange(len(shift)) + shift] = np.concatenate(parts)
    return filled
