"""Zones of the field under the tiles of a frame, where rims clip the pupil, and the tables of their corners."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simulator.optics.defocus.aperture_kernel import Taps, clipped_weights, make_taps
from simulator.optics.defocus.aperture_mean_tables import Image, aperture_taps
from simulator.optics.defocus.aperture_samples import aperture_points, aperture_samples
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, TILE_COLUMNS, TILE_ROWS, Method
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.defocus.photosite_area import WHOLE, PhotositeArea
from simulator.optics.defocus.tile_methods import TileChoice


@dataclass(frozen=True)
class Zones:
    """Zones under (rows, columns) of tiles, the first of which lies at (x, y) on the sensor, a whole number of tiles."""

    eyes: CatsEyes
    x: int
    y: int
    tiles: tuple[int, int]

    @property
    def across(self) -> int:
        """Zones side by side in a tile."""
        return TILE_COLUMNS // self.eyes.zone_px

    @cached_property
    def _first_row(self) -> int:
        return self.y // self.eyes.zone_px

    @cached_property
    def fields(self) -> np.ndarray:
        """Field at each corner, (corner rows, corner columns, 2)."""
        side, (rows, columns) = self.eyes.zone_px, self.tiles
        last_row = (self.y + rows * TILE_ROWS - 1) // side
        x = self.x + side * np.arange(columns * self.across + 1)
        return self.eyes.fields(x[None, :], side * np.arange(self._first_row, last_row + 2)[:, None])

    @cached_property
    def _clips(self) -> np.ndarray:
        return self.eyes.clips(self.fields).ravel()

    @cached_property
    def first_corner(self) -> np.ndarray:
        """Number of the upper left corner of each tile's zones, -1 where no rim clips the pupil: (rows, columns)."""
        rows, columns = self.tiles
        above = (self.y + np.arange(rows) * TILE_ROWS) // self.eyes.zone_px - self._first_row
        first = above[:, None] * self.fields.shape[1] + np.arange(columns) * self.across
        return np.where(self._clips[self.corners(first.ravel())].any(axis=(1, 2)).reshape(first.shape), first, -1)

    def corners(self, first_corners: np.ndarray) -> np.ndarray:
        """Numbers of all corners of the tiles' zones, from the upper left one of each tile (tiles,): (tiles, 2, across + 1)."""
        below, right = self.fields.shape[1] * np.arange(2)[:, None], np.arange(self.across + 1)
        return first_corners[:, None, None] + below + right

    def images(
        self,
        chosen: TileChoice,
        images: list[Image],
        places: np.ndarray,
        samples_per_axis: int,
        area: PhotositeArea = WHOLE,
    ) -> tuple[list[Taps], list[int], np.ndarray]:
        """Taps of clipped tiles, the node number of each, and the taps' index by corner and image: (corners, images) int32.

        images, places: of `TileChoice.table`. Where a rim clips the pupil, the slope of a surface is ignored.
        """
        needed = self._needed(chosen, len(images), places)
        whole, cut = np.nonzero((needed & ~self._clips[:, None]).any(axis=0))[0], np.nonzero(needed & self._clips[:, None])
        taps = aperture_taps(self.eyes.pupil, [images[index] for index in whole], samples_per_axis, area)
        entries = np.zeros(needed.shape, np.int32)
        entries[:, whole] = np.arange(len(whole))
        entries[cut] = len(whole) + np.arange(len(cut[0]))
        radii_px, nodes = (np.array([getattr(image, name) for image in images]) for name in ("radius_px", "node"))
        cut_images = clipped_weights(self.eyes.pupil, self._open_fields(cut[0]), radii_px[cut[1]], samples_per_axis, area)
        numbers = [*nodes[whole], *nodes[cut[1]]]
        return taps + make_taps(cut_images, samples_per_axis), numbers, entries

    def cut_counts(self, chosen: TileChoice, images: list[Image], places: np.ndarray) -> np.ndarray:
        """Corners at which a rim clips each image, so that `images` makes taps of it: (images,). Arguments as of `images`."""
        return np.asarray((self._needed(chosen, len(images), places) & self._clips[:, None]).sum(axis=0))

    def _needed(self, chosen: TileChoice, images: int, places: np.ndarray) -> np.ndarray:
        """Which images the tiles around each corner use: (corners, images) bool."""
        needed = np.zeros((len(self._clips), images), bool)
        mean = chosen.tiles_with(Method.MEAN, Method.COMPOSITE, Method.CORRECTED) & (chosen.zone >= 0)
        for layer, visible in enumerate(chosen.visible):
            tiles = mean & visible
            corners = self.corners(chosen.zone[tiles]).reshape(-1, 2 * (self.across + 1))
            first, count = places[chosen.first_image[layer][tiles]], chosen.images[layer][tiles]
            for node in range(int(count.max(initial=0))):
                held = count > node
                needed[corners[held], (first[held] + node)[:, None]] = True
        return needed

    def _open_fields(self, corners: np.ndarray) -> np.ndarray:
        numbers, index = np.unique(corners, return_inverse=True)
        fields = self.fields.reshape(-1, 2)[numbers]
        return self.eyes.open_fields(fields).reshape(-1, 2)[index]

    def around_blocks(self, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners around the middle of each block, (blocks, 4), -1 where no rim clips the pupil, and their bilinear weights."""
        side = self.eyes.zone_px
        down, y = np.divmod(self.y + (rows + 0.5) * BLOCK_ROWS, side)
        right, x = np.divmod((columns + 0.5) * BLOCK_COLUMNS, side)
        first = (down - self._first_row).astype(int) * self.fields.shape[1] + right.astype(int)
        corners = self.corners(first)[:, :, :2].reshape(-1, 4)
        shares = np.stack([side - y, y], axis=1)[:, :, None] * np.stack([side - x, x], axis=1)[:, None, :] / side**2
        return np.where(self._clips[corners].any(axis=1, keepdims=True), corners, -1), shares.reshape(-1, 4)

    def points(
        self,
        corners: np.ndarray,
        shares: np.ndarray,
        count: int,
        samples_per_axis: int,
        area: PhotositeArea,
        known: dict[int, np.ndarray],
    ) -> np.ndarray:
        """Aperture samples of each block, (blocks, count, 5), interpolated between the samples of its corners.

        known: `aperture_points` of corners that were made before, of this count; others are added.
        """
        numbers, sets = np.unique(corners, return_inverse=True)
        found = {number: there for number in numbers.tolist() if (there := known.get(number)) is not None}
        new = [number for number in numbers.tolist() if number not in found]
        found |= zip(new, aperture_points(self.eyes.pupil, self._open_fields(np.array(new, int)), count), strict=True)
        known.update(found)
        around = np.stack([found[number] for number in numbers.tolist()])
        made = aperture_samples(self.eyes.pupil, count, samples_per_axis, area.open_side)
        points = np.repeat(made[None], len(corners), axis=0)
        places = zip(sets.reshape(corners.shape).T, shares.astype(np.float32).T, strict=True)
        points[..., :2] = sum(around[own] * share[:, None, None] for own, share in places)
        return points
