"""Tables that kernels/defocus.cl reads: where the running sums of a strip are read for each radius."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.device import declared_struct, kernel_source
from simulator.optics.defocus.aperture_kernel import CHUNK, Taps, photosite_weights, taps_of
from simulator.optics.defocus.tilted_kernel import tilted_weights
from simulator.optics.geometry.interleaved_columns import element
from simulator.optics.pupil.pupil import Pupil


@dataclass(frozen=True)
class Image:
    """An image of the aperture: of signed radius radius_px [photosites], on a surface of this slope, x and y.

    node: number of the radius where the mean is interpolated between radii.
    """

    radius_px: float
    slope: tuple[float, float] = (0.0, 0.0)
    node: int = 0


@dataclass(frozen=True)
class BlurTable:
    """Means over images of the aperture, one node each, as kernels/aperture_mean.h declares them.

    nodes: (nodes,) of `struct node`. taps: (taps,) of `struct tap`.
    """

    nodes: np.ndarray
    taps: np.ndarray


@lru_cache(maxsize=4096)
def aperture_taps(pupil: Pupil, radius_px: float, slope: tuple[float, float], over: int) -> Taps:
    """Taps of the aperture's image on the axis, on a surface of this slope."""
    if any(slope):
        return taps_of(tilted_weights(pupil, radius_px, slope, over), over)
    return taps_of(photosite_weights(pupil, radius_px, over), over)


def blur_table(images: Sequence[Taps], numbers: Sequence[int], over: int, rows: int, set_columns: int) -> BlurTable:
    """Table of these images for a band of `over` x `over` samples per photosite, so many rows of samples and columns of a set.

    numbers: of their radii, `Image.node`. The taps of all nodes come first, then those of the columns' minima.
    """
    # Samples and running sums of a plane differ in rows: below the sums of all rows stand the columns' minima.
    taps = [(image.rows, image.columns, image.weights, rows if image.direct else rows + 2) for image in images]
    sides = [(0 * image.sides, image.sides, image.totals, rows + 2) for image in images]
    counts = np.array([_whole_chunks(len(part[0])) for part in taps + sides])
    first, (all_taps, all_sides) = np.cumsum(counts) - counts, np.split(counts, 2)
    nodes = np.zeros(len(images), declared_struct(kernel_source("aperture_mean.h"), "node"))
    nodes["first_tap"], nodes["first_side"] = np.split(first, 2)
    nodes["taps"], nodes["sides"] = all_taps, all_sides
    nodes["radius"], nodes["direct"] = numbers, [image.direct for image in images]
    return BlurTable(nodes, _taps(taps + sides, counts, over, set_columns))


def _taps(
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray, int]], counts: np.ndarray, over: int, set_columns: int
) -> np.ndarray:
    """Taps (taps,) of `struct tap`; parts: rows and columns from the photosite's first sample, weights, rows of a plane.

    counts: taps of each part, with those of weight 0 that fill it up to whole chunks.
    """
    taps = np.zeros(int(counts.sum()) + CHUNK, declared_struct(kernel_source("aperture_mean.h"), "tap"))  # no buffer is empty
    down, right, weights = (_padded([part[index] for part in parts]) for index in range(3))
    height = np.repeat([*(part[3] for part in parts), 0], [*counts, CHUNK])
    for parity in (0, 1):
        taps["offset"][:, parity] = element(0, down, over * parity + right, over, height, set_columns)
    taps["weight"] = weights
    return taps


def _whole_chunks(count: int) -> int:
    return -(-count // CHUNK) * CHUNK


def _padded(parts: list[np.ndarray]) -> np.ndarray:
    """All parts in a row, each filled up with zeros to whole chunks; a chunk more."""
    filled = [np.pad(part, (0, _whole_chunks(len(part)) - len(part))) for part in parts]
    return np.concatenate([*filled, np.zeros(CHUNK, filled[0].dtype)])
