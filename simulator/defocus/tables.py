"""Tables that kernels/defocus.cl reads: where the running sums of a strip are read for each radius."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.defocus.aperture_image import CHUNK, Taps, photosite_weights, taps_of
from simulator.defocus.tilted_image import tilted_weights
from simulator.lens.pupil import Pupil


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
    """Means over images of the aperture, one node each; arrays as kernels/defocus.cl names them."""

    nodes: np.ndarray
    taps: np.ndarray
    weights: np.ndarray
    sides: np.ndarray
    totals: np.ndarray


@lru_cache(maxsize=4096)
def aperture_taps(pupil: Pupil, radius_px: float, slope: tuple[float, float], over: int) -> Taps:
    """Taps of the aperture's image on the axis, on a surface of this slope."""
    if any(slope):
        return taps_of(tilted_weights(pupil, radius_px, slope, over), over)
    return taps_of(photosite_weights(pupil, radius_px, over), over)


def blur_table(images: Sequence[Taps], numbers: Sequence[int], over: int, rows: int, way_columns: int) -> BlurTable:
    """Table of these images for a strip of `over` x `over` points per photosite with this many rows and half columns.

    numbers: of their radii, `Image.node`.
    """
    return BlurTable(
        nodes=_nodes(images, numbers),
        taps=_places(
            [(image.rows, image.columns) for image in images], over, [rows + (not i.direct) for i in images], way_columns
        ),
        weights=_padded([image.weights for image in images]).astype(np.float32),
        sides=_places([(0 * image.sides, image.sides) for image in images], over, [1] * len(images), way_columns),
        totals=_padded([image.totals for image in images]).astype(np.float32),
    )


def _nodes(images: Sequence[Taps], numbers: Sequence[int]) -> np.ndarray:
    taps, sides = (np.array([_whole_chunks(count) for count in counts]) for counts in _counts(images))
    first = [np.concatenate([[0], np.cumsum(counts)[:-1]]) for counts in (taps, sides)]
    direct = [image.direct for image in images]
    return np.stack([first[0], taps, first[1], sides, numbers, direct], axis=-1).astype(np.int32)


def _counts(images: Sequence[Taps]) -> tuple[list[int], list[int]]:
    return [len(image.weights) for image in images], [len(image.totals) for image in images]


def _whole_chunks(count: int) -> int:
    return -(-count // CHUNK) * CHUNK


def _padded(parts: list[np.ndarray]) -> np.ndarray:
    """All parts in a row, each filled up with zeros to whole chunks; a chunk more, since no buffer is empty."""
    filled = [np.pad(part, (0, _whole_chunks(len(part)) - len(part))) for part in parts]
    return np.concatenate([*filled, np.zeros(CHUNK, filled[0].dtype)])


def _places(offsets: list[tuple[np.ndarray, np.ndarray]], over: int, rows: list[int], way_columns: int) -> np.ndarray:
    """Distance in a strip in the order of kernels/ways.h, for an even and for an odd photosite: (2, places) int32.

    rows: of the planes that each image's taps are read from.
    """
    ways = 2 * over
    down, right = (_padded([pair[axis] for pair in offsets]) for axis in (0, 1))
    height = np.repeat([*rows, 0], [*(_whole_chunks(len(pair[0])) for pair in offsets), CHUNK])
    sides = [over * parity + right for parity in (0, 1)]
    return np.stack([((side % ways) * height + down) * way_columns + side // ways for side in sides]).astype(np.int32)
