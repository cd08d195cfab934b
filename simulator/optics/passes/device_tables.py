"""Tables of kernels/defocus.cl on the device: of the pupil that is the same everywhere, and of zones of the field."""

from functools import cache

import numpy as np

from simulator.device import Device
from simulator.optics.defocus.aperture_samples import lens_points
from simulator.optics.defocus.defocus import TILE_COLUMNS
from simulator.optics.defocus.running_sum_tables import aperture_taps, blur_table
from simulator.optics.passes.tile_plan import TilePlan


class BlurTables:
    """Tables for strips of `over` x `over` samples per photosite.

    tiles: the methods that the frame's tiles get, and the zones of the field.
    """

    def __init__(self, tiles: TilePlan, device: Device, over: int):
        self._device, self._pupil, self._zones, self.over = device, tiles.optics.defocus.pupil, tiles.zones, over
        self._chosen = tiles.chosen.part(slice(0, len(tiles.chosen.wanted)), over)
        self._size = over, over * tiles.area.strip_rows, tiles.area.set_columns
        self._nothing = device.zeros((1,), np.int32)
        self.of_tiles, self._images = cache(self._of_tiles), cache(self._chosen.table)

    def _of_tiles(self, clipped: bool) -> tuple[dict[str, object], np.ndarray, bool]:
        """Arguments of kernels/defocus.cl, the place in them of each of `TileChoice.all_images`, whether any reads sums.

        clipped: of the tiles in zones.
        """
        images, places = self._images()
        if clipped:
            taps, numbers, entries = self._zones.images(self._chosen, images, places, self.over)
        else:
            taps, entries = [aperture_taps(self._pupil, image.radius_px, image.slope, self.over) for image in images], None
            numbers = [image.node for image in images]
        table = blur_table(taps, numbers, *self._size)
        buffers = {name: self._device.upload(array) for name, array in vars(table).items()}
        buffers["entries"] = self._nothing if entries is None else self._device.upload(entries)
        sums = not all(image.direct for image in taps)
        return buffers, places, sums

    def corners(self, first_corners: np.ndarray | None):
        """Device buffer of the corners of tiles, as kernels/zones.h has them; without zones one that nobody reads.

        first_corners: (tiles,) of TileChoice.zone.
        """
        if first_corners is None:
            return self._nothing
        images, _ = self._images()
        return self._device.upload((len(images) * self._zones.corners(first_corners)).astype(np.uint32))

    def points(self, count: int, around: tuple[np.ndarray, np.ndarray] | None) -> np.ndarray:
        """Points of kernels/occlusion.cl for blocks, (blocks, count, 5), or (1, count, 5) for all of them.

        around: what `Zones.around_blocks` says of the blocks; None: no rim hides anything.
        """
        if around is None:
            return lens_points(self._pupil, count, self.over)[None]
        return self._zones.points(*around, count, self.over)

    def around_blocks(self, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`Zones.around_blocks`, without zones as well."""
        if self._zones is None:
            return np.full((len(rows), 4), -1), np.zeros((len(rows), 4))
        return self._zones.around_blocks(rows, columns)

    def defines(self, clipped: bool) -> dict[str, int]:
        """Macros of kernels/zones.h. The photosites of a work-item lie in one zone."""
        if not clipped:
            return {"ZONE": 0, "SPAN": self._device.span}
        zone_px = self._zones.eyes.zone_px
        return {"ZONE": zone_px, "TILE_ZONES": TILE_COLUMNS // zone_px, "SPAN": min(self._device.span, zone_px // 2)}
