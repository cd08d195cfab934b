"""Tables of kernels/defocus.cl on the device: of the unclipped pupil, and of the clipped pupil in zones of the field."""

from collections.abc import Callable, Hashable
from functools import cache
from typing import TypeVar, cast

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.aperture_kernel import Taps
from simulator.optics.defocus.aperture_mean_tables import BlurTable, aperture_taps, blur_table
from simulator.optics.defocus.aperture_samples import aperture_samples, moving_samples
from simulator.optics.defocus.defocus import TILE_COLUMNS, Method
from simulator.optics.defocus.field_zones import Zones
from simulator.optics.defocus.radius_slabs import SlabLists, make_slab_lists
from simulator.optics.passes.tile_plan import TilePlan

MOST_KEPT_BYTES = 1 << 27  # of a table that is kept for the next frame
T = TypeVar("T")


def _last_known(tiles: TilePlan, samples_per_axis: int) -> dict[Hashable, object]:
    """Tables that are kept with the blur; those of one window at a time, so that strips of a frame do not add up."""
    empty: dict[Hashable, dict[Hashable, object]] = {}
    windows = tiles.defocus.remember(("tables", samples_per_axis), lambda: empty)
    if tiles.key not in windows:
        windows.clear()
    return windows.setdefault(tiles.key, {})


class DeviceTables:
    """Tables for row bands with so many samples per photosite and axis.

    tiles: methods of the frame's tiles, and zones of the field.
    whole: whether all rows of a band are sampled, whatever the window: running sums begin at its first row, and highlights are
        counted in all of it. layout: of the samples of a band with its margins.
    """

    def __init__(self, tiles: TilePlan, device: Device, samples_per_axis: int) -> None:
        self._device, self._defocus, self._zones = device, tiles.defocus, tiles.zones
        self._pupil, self._area = self._defocus.pupil, self._defocus.area
        self.samples_per_axis = samples_per_axis
        self._chosen = tiles.chosen.part(slice(0, len(tiles.chosen.computed)), samples_per_axis)
        self._unread = device.zeros((1,), np.int32)
        self._known = _last_known(tiles, samples_per_axis)
        self.of_tiles, self._images, self._taps = cache(self._of_tiles), cache(self._chosen.table), cache(self._find_taps)
        self.whole = tiles.highlight_limit is not None or any(map(self.reads_sums, self._kinds()))
        self.layout = tiles.area.band_layout(samples_per_axis, whole=self.whole)

    @property
    def zones(self) -> Zones:
        """Zones of the field; only clipped tiles and blocks ask for them."""
        assert self._zones is not None  # without zones nothing is clipped
        return self._zones

    def _kinds(self) -> list[bool]:
        """Whether the tiles that take means are clipped: the arguments with which `of_tiles` may be called."""
        means = self._chosen.tiles_with(Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
        return np.unique(self._chosen.zone[means] >= 0).tolist()

    def reads_sums(self, clipped: bool) -> bool:
        """Whether any mean reads running sums; clipped: as of `of_tiles`."""
        return self._kept(("sums", clipped), lambda: not all(image.direct for image in self._taps(clipped)[0]))

    def _kept(self, name: Hashable, make: Callable[[], T], size: Callable[[T], int] = lambda made: 0) -> T:
        """Return `make()`, kept with the blur for the next frame of the same window. size: of what is made [bytes]."""
        if name in self._known:
            return cast(T, self._known[name])
        made = make()
        if size(made) <= MOST_KEPT_BYTES:
            self._known[name] = made
        return made

    def _find_taps(self, clipped: bool) -> tuple[list[Taps], list[int], np.ndarray | None]:
        """Taps of all images of the aperture, the number of each image's node, and with zones the images' places by corner."""
        images, places = self._images()
        if clipped:
            return self.zones.images(self._chosen, images, places, self.samples_per_axis, self._area)
        taps = aperture_taps(self._pupil, images, self.samples_per_axis, self._area)
        return taps, [image.node for image in images], None

    def _of_tiles(self, clipped: bool) -> tuple[dict[str, Buffer], np.ndarray]:
        """Table arguments of kernels/defocus.cl, and the index in them of each of `TileChoice.all_images`.

        clipped: whether the table is that of tiles in zones, where rims clip the pupil.
        """

        def make() -> tuple[BlurTable, np.ndarray | None]:
            taps, numbers, entries = self._taps(clipped)
            return blur_table(taps, numbers, self.layout), entries

        def size(made: tuple[BlurTable, np.ndarray | None]) -> int:
            return made[0].nodes.nbytes + made[0].taps.nbytes + (0 if made[1] is None else made[1].nbytes)

        table, entries = self._kept(("table", clipped, self.layout), make, size)
        buffers = {name: self._device.upload(array) for name, array in vars(table).items()}
        buffers["entries"] = self._unread if entries is None else self._device.upload(entries)
        return buffers, self._images()[1]

    def corners(self, first_corners: np.ndarray | None) -> Buffer:
        """Device buffer of the corners of tiles for kernels/zones.h; a buffer that is not read where there are no zones.

        first_corners: (tiles,) of TileChoice.zone; None: no zones.
        """
        if first_corners is None:
            return self._unread
        images, _ = self._images()
        return self._device.upload((len(images) * self.zones.corners(first_corners)).astype(np.uint32))

    def points(self, count: int, around: tuple[np.ndarray, np.ndarray] | None, *, relaxed: bool = False) -> np.ndarray:
        """Aperture samples of kernels/occlusion.cl for blocks, (blocks, count, 5), or (1, count, 5) shared by all.

        around: `Zones.around_blocks` of the blocks; None: no rim clips the pupil. relaxed: as of `aperture_samples`.
        """
        if around is None:
            return aperture_samples(self._pupil, count, self.samples_per_axis, self._area.open_side, relaxed=relaxed)[None]
        known: dict[int, np.ndarray] = self._kept(("points", count), dict)
        if sum(points.nbytes for points in list(known.values())) > MOST_KEPT_BYTES:  # another thread may add some
            known.clear()
        return self.zones.points(*around, count, self.samples_per_axis, self._area, known)

    def slab_lists(self, present: np.ndarray, even_px: np.ndarray) -> SlabLists:
        """`make_slab_lists` of blocks, which are mostly those of the frame before."""
        blocks = "slabs", present.tobytes(), even_px.tobytes()
        return self._kept(blocks, lambda: make_slab_lists(self._defocus, present, even_px), lambda made: made.slabs.nbytes)

    def moving_points(self, count: int, around: tuple[np.ndarray, np.ndarray] | None) -> tuple[np.ndarray, np.ndarray]:
        """Aperture samples as of `points`, and the share of the light that has come at the instant of each, (count,)."""
        if around is not None:
            return self.points(count, around), (np.arange(count) + 0.5) / count
        samples = moving_samples(self._pupil, count, self.samples_per_axis, self._area.open_side)
        return samples[None, :, :5], samples[:, 5]

    def around_blocks(self, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`Zones.around_blocks`, or corners of -1 where there are no zones."""
        if self._zones is None:
            return np.full((len(rows), 4), -1), np.zeros((len(rows), 4))
        return self._zones.around_blocks(rows, columns)

    def defines(self, clipped: bool) -> dict[str, int]:
        """Macros of kernels/zones.h; SPAN is limited so that the photosites of a work-item lie in one zone."""
        if not clipped:
            return {"ZONE": 0, "SPAN": self._device.span}
        zone_px = self.zones.eyes.zone_px
        return {"ZONE": zone_px, "TILE_ZONES": TILE_COLUMNS // zone_px, "SPAN": min(self._device.span, zone_px // 2)}
