"""Lamps: pixels of a scene so bright that each is drawn behind the lens by itself.

Light samples and cut kernels are exact to a share of the light, which of a lamp is far above the noise of the dark around it.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from simulator.optics.defocus.scene_light import brighter_pixels
from simulator.optics.geometry.projection import Projection
from simulator.scene.scene import Scene

LAMP_TIMES = 16.0  # limit of highlights that the brightest pixel of a scene with lamps exceeds
MOST_LAMPS, MOST_ALIGNED = 2048, 16384  # drawn one by one; the second where all lie alike on their photosites
LIMIT_TIMES = 4.0  # limit of highlights over the mean of the scene's darker nine tenths
FEW_PLACES = 4  # of pixels within photosites, on an axis
WORTH = 0.5  # of the brightest pixel: rest above which drawing a part of the lamps helps nothing


@dataclass(frozen=True)
class Lamps:
    """Pixels of a scene whose light is drawn by itself.

    rows, columns: (lamps,) of the pixels, in the order of the scene. most: (channels,) electron radiance that a pixel keeps at
    most [e- s^-1 um^-2 sr^-1]. rest: electron radiance of the brightest highlight that is not drawn, the same unit.
    """

    rows: np.ndarray = field(repr=False)
    columns: np.ndarray = field(repr=False)
    most: tuple[float, ...] = ()
    rest: float = 0.0

    @property
    def count(self) -> int:
        """Number of lamps."""
        return len(self.rows)

    def split(self, planes: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Electron radiance that the pixels keep (lamps, channels) float32, and what is drawn, (lamps, channels) float64.

        A pixel keeps the least light around it. planes: (rows, columns, bands) of the scene. weights: (bands, channels).
        """
        height, width, _ = planes.shape
        own = planes[self.rows, self.columns].astype(np.float64) @ weights
        kept = np.minimum(own, self.most)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                rows, columns = np.clip(self.rows + down, 0, height - 1), np.clip(self.columns + right, 0, width - 1)
                kept = np.minimum(kept, planes[rows, columns].astype(np.float64) @ weights)
        left = kept.astype(np.float32)
        return left, np.maximum(own - left, 0.0)

    def without(self, scene: Scene, weights: np.ndarray) -> Scene:
        """Return a picture whose lamps are as bright as what they keep. weights: (bands, channels)."""
        left, drawn = self.split(scene.planes, weights)
        share = (left.max(axis=1) / (left + drawn).max(axis=1)).astype(np.float32)
        planes = scene.planes.copy()
        planes[self.rows, self.columns] *= share[:, None]
        return replace(scene, planes=planes)


def find_lamps(
    scene: Scene, weights: np.ndarray, projection: Projection, limits: tuple[float, ...], brightest: float
) -> Lamps | None:
    """Lamps of a picture; None where it has none, or too many of one brightness.

    weights: (bands, channels) of planes in electron radiance. limits: of highlights, by channel [electron radiance].
    brightest: electron radiance of the brightest pixel in any channel.
    """
    if brightest <= LAMP_TIMES * min(limits):
        return None
    rows, columns, light = brighter_pixels(scene.planes, weights, np.array(limits, np.float32))
    if not len(rows) or not (light > LAMP_TIMES * np.array(limits)).any():
        return None
    most, rest = (MOST_ALIGNED if lie_alike(projection) else MOST_LAMPS), 0.0
    if len(rows) > most:
        strength = light.max(axis=1)
        order = np.argsort(-strength, kind="stable")
        rest = float(strength[order[most]])
        if rest > WORTH * brightest:
            return None
        kept = np.sort(order[:most])
        rows, columns = rows[kept], columns[kept]
    return Lamps(rows, columns, tuple(limit / LIMIT_TIMES for limit in limits), rest)


def lie_alike(projection: Projection) -> bool:
    """Whether pixels of the scene lie at few places within photosites, so that few images of lamps are computed."""
    places = (np.arange(64) + 0.5 - projection.offset_x) / projection.scale
    return len(np.unique(np.round(places % 1.0, 6))) <= FEW_PLACES
