"""What weights of samples leave of light between pixels, where a scene has one pixel per photosite: measured on its light.

The weights of pixels that photosites have by their samples, less the exact ones (`path_weights`), are a filter. Its output on
parts of the scene is what is left, of which the quantile MOST counts.
"""

import math
from collections.abc import Sequence

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.path_weights import Lattice
from simulator.optics.defocus.scene_light import MOST, composite, layer_at, seen_contrast
from simulator.scene.scene import Scene

PARTS, PART_PX = 4, 40  # parts per axis of a large scene whose light is looked at, and their side [pixels]


class SceneParts:
    """Parts of a scene with what lies around them, as the border of the scene goes on, ready to be filtered.

    shape: rows and columns of a part. around_px: pixels to each side of it.
    """

    def __init__(self, scene: Scene, to_share: np.ndarray, accuracy: Accuracy, around_px: int) -> None:
        """to_share: (bands, channels) of scene planes in the brightest light. Light of lamps is left out."""
        self.accuracy, self.around_px = accuracy, around_px
        length, width = scene.planes.shape[:2]
        self.shape = min(PART_PX, length), min(PART_PX, width)
        tops, lefts = (
            np.unique(np.linspace(0, size - part, PARTS).astype(int)).tolist()
            for size, part in zip((length, width), self.shape, strict=True)
        )
        rows, columns = (
            [_around(first, part, around_px, size) for first in firsts]
            for firsts, part, size in ((tops, self.shape[0], length), (lefts, self.shape[1], width))
        )
        parts = []
        for down in rows:
            for right in columns:
                place = np.ix_(down, right)
                light = [layer_at(one, place, to_share) for one in scene.layers]
                parts.append(np.moveaxis(composite(light), -1, 0))
        self.size = len(rows[0]), len(columns[0])
        self.spectra = np.fft.rfft2(np.array(parts, np.float64))

    def filtered(self, weights: np.ndarray) -> np.ndarray:
        """Light of each photosite that has these weights (n, n) of the pixels around it, (parts, channels, rows, columns)."""
        found = np.fft.irfft2(self.spectra * np.conj(np.fft.rfft2(weights, self.size)), self.size)
        first = self.around_px - len(weights) // 2
        return np.asarray(found[..., first : first + self.shape[0], first : first + self.shape[1]])

    def left(self, lacked: np.ndarray, light: np.ndarray) -> float:
        """What weights leave that exact ones (n, n) lack, in the noise of `light`, as a share of the brightest light.

        light: `filtered` by the exact ones.
        """
        return float(np.quantile(seen_contrast(self.filtered(lacked), light, self.accuracy), MOST))


def parts_around(
    scene: Scene, weights: np.ndarray, per_share: float, accuracy: Accuracy, pairs: Sequence[Lattice]
) -> SceneParts:
    """`SceneParts` with room for filters (n, n) of these sizes. weights, per_share: as of `scene_contrast`."""
    return SceneParts(scene, per_share * weights, accuracy, max(len(exact) // 2 for _, exact in pairs))


def _around(first: int, count: int, beside: int, size: int) -> np.ndarray:
    """Numbers of pixels of a part and beside it; beyond the border of the scene those at the border."""
    return np.clip(np.arange(first - beside, first + count + beside), 0, size - 1)


def parts_of(scene: Scene, scale: float) -> list[tuple[slice, slice]]:
    """Return squares of PART_PX photosites of a scene, all of a small one."""
    side = max(math.ceil(PART_PX * scale), 2)
    tops, lefts = (
        np.unique(np.linspace(0, max(length - side, 0), PARTS).astype(int)).tolist() for length in scene.planes.shape[:2]
    )
    return [(slice(top, top + side), slice(left, left + side)) for top in tops for left in lefts]
