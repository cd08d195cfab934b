"""Takes points of light out of a strip's planes, and spreads them over the blocks that they reach."""

import numpy as np

from simulator.device import Buffer
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS
from simulator.optics.defocus.highlights import BRIGHT, SMALLEST_PX, Lights, brightest, reaching, spot_weights
from simulator.optics.geometry.interleaved_columns import column_of


class StripLights:
    """Lights of a strip (`simulator.optics.passes.row_band.Strip`) and which of its blocks they reach.

    strip_row: row of the area at which the strip begins. places: (blocks, 4) uint32 as kernels/occlusion.cl has them.
    limit: (channels,) above which a sample is a light.
    """

    def __init__(self, strip, strip_row: int, places: np.ndarray, limit: np.ndarray):
        self.strip, self.places = strip, places
        self.origin_px = strip.area.x, strip.area.y + strip_row
        shape = strip.layout.shape(len(strip.planes) * strip.layer_planes)
        self.sampled = strip.device.download(strip.sampled, shape, np.float32)
        self.lights = brightest(self._bright(limit), strip.over, strip.area.y + strip_row)
        self.lists = reaching(self.lights, self._pupil, strip.over, places[:, 1].astype(int), 2 * places[:, 0].astype(int))
        self.reached = np.array([len(own) > 0 for own in self.lists])

    @property
    def _pupil(self):
        return self.strip.defocus.pupil

    def _bright(self, limit: np.ndarray) -> Lights:
        """Samples above the limit whose spots are larger than a photosite."""
        strip, radii = self.strip, self.strip.defocus.radii_px
        shape = strip.layout.shape(max(len(strip.maps.scene_radius), 1))
        radius = strip.device.download(strip.radius, shape, np.float32)
        found, maps = [], 0
        for layer, px in enumerate(radii):
            light = self.sampled[layer * strip.layer_planes :][: strip.channels]
            place = np.nonzero((light > limit[:, None, None, None]).any(axis=0))
            column_set, row, column = place
            excess = np.maximum(light[:, *place] - limit[:, None] / BRIGHT, 0.0)  # the scene's mean stays
            own = radius[maps, *place] if np.ndim(px) else np.full(len(row), px, np.float32)
            found.append((row, column_of(column_set, column, strip.over), np.full(len(row), layer), own, excess))
            maps += np.ndim(px) > 0
        lights = Lights(*(np.concatenate(parts, axis=-1) for parts in zip(*found, strict=True)))
        return lights.of(np.abs(lights.radii_px) > SMALLEST_PX)

    def take(self) -> None:
        """Take what is too bright out of the strip's planes."""
        strip, lights = self.strip, self.lights
        plane = lights.layers * strip.layer_planes + np.arange(strip.channels)[:, None]
        element = strip.layout.element(plane, lights.rows, lights.columns).ravel()
        left = self.sampled.reshape(-1)[element] - lights.excess.ravel()
        self._run("lights_take", (len(element),), {"places": element.astype(np.uint32), "left": left.astype(np.float32)})

    def spread(self, slabs: Buffer, light: Buffer, band: dict[str, int]) -> None:
        """Give the photosites of the reached blocks their share. band: fields of `struct row_band` of kernels/row_band.h."""
        lights, lists = self.lights, [own for own in self.lists if len(own)]
        counts = np.array([len(own) for own in lists])
        weights, first, side = spot_weights(lights, self._pupil, self.strip.over, self.strip.defocus.eyes, self.origin_px)
        arrays = {
            "blocks": self.places[self.reached],
            "ranges": np.stack([np.cumsum(counts) - counts, counts], axis=-1).astype(np.uint32),
            "reaching": np.concatenate(lists).astype(np.uint32),
            "lights": np.stack([lights.columns, lights.rows, lights.layers, first, side], axis=-1).astype(np.int32),
            "excess": np.concatenate([lights.radii_px[:, None], lights.excess.T], axis=-1).astype(np.float32),
            "weights": weights,
        }
        size = (BLOCK_COLUMNS // 2, 2 * BLOCK_ROWS, len(lists))
        self._run("lights_spread", size, arrays, radius=self.strip.radius, slabs=slabs, light=light, band=band)

    def _run(self, name: str, size: tuple[int, ...], arrays: dict[str, np.ndarray], **arguments) -> None:
        device = self.strip.device
        buffers = {key: device.upload(np.ascontiguousarray(array)) for key, array in arrays.items()}
        kernel = device.kernel(name, self.strip.defines, file="lights.cl")
        device.run(kernel, size, None, sampled=self.strip.sampled, **buffers, **arguments)
