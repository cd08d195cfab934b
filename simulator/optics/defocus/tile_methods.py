"""Which method each tile of a blurred frame gets, and which images of the aperture its means need."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.defocus import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    STEEPEST_PX,
    TILE_COLUMNS,
    TILE_ROWS,
    Defocus,
    Method,
    RadiusStatistics,
    seen_from,
)
from simulator.optics.defocus.error_laws import product_error
from simulator.optics.defocus.radius_slabs import BlockChoice, even_radius
from simulator.optics.defocus.running_sum_tables import Image

NODES_PER_PX = 2  # between two nodes the mean is a cubic in the radius
CONSTANT_NODES_PER_PX = 32  # radii at which a tile of one radius is computed
ROWS_IN_TILE, COLUMNS_IN_TILE = TILE_ROWS // BLOCK_ROWS, TILE_COLUMNS // BLOCK_COLUMNS  # blocks


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile; arrays of (tile rows, tile columns), some with the layers as first axis.

    wanted: whether it is computed. methods: of Method; OCCLUSION where points of the aperture compute all of the tile.
    over: points per photosite and axis.
    visible: (layers, ...) whether a layer can be seen from the tile.
    constant: (layers, ...) whether one blur circle is enough.
    first_image, images: (layers, ...) where the tile's images of the aperture begin in `all_images`, and how many it has: one,
        or one for each 1 / NODES_PER_PX photosites of signed radius.
    blocks: what the tiles' blocks need in addition.
    zone: number of the upper left corner of zones around it (`zones.Zones`); -1 where no rim hides anything.
    """

    wanted: np.ndarray
    methods: np.ndarray
    over: np.ndarray
    visible: np.ndarray
    constant: np.ndarray
    first_image: np.ndarray
    images: np.ndarray
    all_images: tuple[Image, ...]
    blocks: BlockChoice
    zone: np.ndarray

    def overs(self) -> list[int]:
        """Return the numbers of points per photosite and axis that occur."""
        return np.unique(self.over[self.wanted]).tolist()

    def part(self, rows: slice, over: int) -> "TileChoice":
        """Rows of tiles; wanted are those with this many points."""
        whole = ("all_images", "blocks")
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items() if name not in whole}
        kept["wanted"] = kept["wanted"] & (kept["over"] == over)
        blocks = self.blocks.part(slice(rows.start * ROWS_IN_TILE, rows.stop * ROWS_IN_TILE), _each_block(kept["wanted"]))
        return TileChoice(**kept, all_images=self.all_images, blocks=blocks)

    def with_method(self, *methods: Method) -> np.ndarray:
        """Wanted tiles that get one of these methods."""
        return self.wanted & np.isin(self.methods, methods)

    def table(self) -> tuple[list[Image], np.ndarray]:
        """Images that wanted tiles need, and the place of each of `all_images` among them."""
        meant = self.visible & self.with_method(Method.COPY, Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
        needed = np.zeros(len(self.all_images) + 1, int)
        np.add.at(needed, self.first_image[meant], 1)
        np.add.at(needed, (self.first_image + self.images)[meant], -1)
        needed = np.cumsum(needed[:-1]) > 0
        return [self.all_images[index] for index in np.flatnonzero(needed)], np.cumsum(needed) - 1


def choose(defocus: Defocus, layer_statistics: list[RadiusStatistics], wanted: np.ndarray) -> TileChoice:
    """Cheapest method for each tile, and each of its blocks, that keeps the error below the tolerance's.

    layer_statistics: of each layer's patches. wanted: (tile rows, tile columns) bool.
    """
    around = [
        seen_from(radius_statistics, defocus.pupil.corner_radius, defocus.largest_px) for radius_statistics in layer_statistics
    ]
    tiles, blocks = ([getattr(seen, part)() for seen in around] for part in ("of_tiles", "of_blocks"))
    methods, over, visible, largest, single = _methods(defocus, tiles)
    block_methods, _, block_visible, block_largest, _ = _methods(defocus, blocks)
    hard = block_methods == Method.OCCLUSION
    some = (methods == Method.OCCLUSION) & ~_all_blocks(hard)
    methods = np.where(some, np.where(single, Method.MEAN, Method.COMPOSITE), methods)
    over = np.where(methods == Method.COPY, 1, over)
    images = _images(defocus, [r.of_blocks() for r in layer_statistics], ~hard, visible & wanted)
    present = np.where(block_visible, np.stack([seen.classes for seen in blocks]), np.uint64(0))
    even = np.stack([even_radius(defocus, seen, block_methods) for seen in blocks])
    points = BlockChoice(_each_block(wanted), block_methods, block_largest, present, even)
    return TileChoice(wanted, methods, over, visible, *images, points, np.full(over.shape, -1))


def _each_block(tiles: np.ndarray) -> np.ndarray:
    """A plane of tiles, as a plane of their blocks."""
    return tiles.repeat(ROWS_IN_TILE, axis=0).repeat(COLUMNS_IN_TILE, axis=1)


def _all_blocks(blocks: np.ndarray) -> np.ndarray:
    """Whether it holds for all blocks of each tile."""
    return blocks.reshape(blocks.shape[0] // ROWS_IN_TILE, ROWS_IN_TILE, -1, COLUMNS_IN_TILE).all(axis=(1, 3))


def _methods(defocus: Defocus, around: list[RadiusStatistics]) -> tuple[np.ndarray, ...]:
    """Method of each place, points per photosite and axis, which layers are visible, largest radius, whether one fills it."""
    accuracy, (visible, largest) = defocus.accuracy, _visible(around)
    smooth = (~visible | (np.stack([seen.steepest_px for seen in around]) <= STEEPEST_PX)).all(axis=0)
    single = (visible.sum(axis=0) == 1) & (~visible | (np.stack([seen.filled for seen in around]) >= 1.0)).all(axis=0)
    reach = np.stack([np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px)) for seen in around])
    several = (visible & (reach > accuracy.sharp_px)).sum(axis=0) > 1
    over = accuracy.over(_smallest(around, visible), largest, defocus.scale)
    apart = ~several & ((over == 1) | (product_error(largest) <= accuracy.allowed))
    cases = [(single & (largest <= accuracy.sharp_px), Method.COPY), (single & smooth, Method.MEAN)]
    cases += [(smooth & apart, Method.COMPOSITE), (smooth, Method.CORRECTED)]
    return np.select(*zip(*cases, strict=True), Method.OCCLUSION), over, visible, largest, single


def _smallest(around: list[RadiusStatistics], visible: np.ndarray) -> np.ndarray:
    """Radius of the smallest blur circle of a surface that can be seen from each tile; 0 where one is in focus."""
    least = [np.maximum(np.maximum(seen.least_px, -seen.greatest_px), 0.0) for seen in around]
    return np.where(visible, np.stack(least), np.inf).min(axis=0)


def _visible(around: list[RadiusStatistics]) -> tuple[np.ndarray, np.ndarray]:
    """Whether each layer can be seen from each place, and the largest blur circle's radius."""
    open_, largest, found = np.ones(around[0].least_px.shape, bool), np.zeros(around[0].least_px.shape), []
    for seen in around:
        visible = open_ & (seen.covered > 0.0)
        found.append(visible)
        reach = np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px))
        largest = np.where(visible, np.maximum(largest, reach), largest)
        open_ &= seen.filled < 1.0
    return np.stack(found), largest


def _images(defocus: Defocus, layer_statistics: list[RadiusStatistics], kept: np.ndarray, needed: np.ndarray) -> tuple:
    """Fields constant, first_image, images and all_images of TileChoice; tiles that are not needed get none.

    layer_statistics: of each layer's blocks. kept: blocks whose radii count. needed: (layers, tile rows, tile columns) bool.
    """
    held = kept | ~_each_block(~_all_blocks(~kept))  # tiles without any get some number
    least, greatest = (
        _over_blocks(layer_statistics, held, "least_px", np.min),
        _over_blocks(layer_statistics, held, "greatest_px", np.max),
    )
    radius = np.rint(0.5 * (least + greatest) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    for layer, own in enumerate(defocus.radii_px):
        if np.ndim(own) == 0:
            radius[layer] = own
    constant = np.maximum(greatest - radius, radius - least) <= defocus.accuracy.same_px
    first, last = np.floor(least * NODES_PER_PX).astype(int) - 1, np.floor(greatest * NODES_PER_PX).astype(int) + 2
    slopes = _slopes(defocus, layer_statistics, held, np.maximum(-first, last) / NODES_PER_PX)
    one, graded = needed & constant, needed & ~constant
    constants, index = np.unique(radius[one], return_inverse=True)
    first_image, count = np.zeros(constant.shape, int), np.zeros(constant.shape, int)
    first_image[one], count[one] = index, 1
    runs = np.stack([*slopes, first])[:, graded].T
    count[graded] = (last - first + 1)[graded]
    starts = [tuple(run) for run in runs.tolist()]
    pairs = zip(starts, count[graded].tolist(), strict=True)
    keys = sorted({(x, y, first + n) for (x, y, first), nodes in pairs for n in range(nodes)})
    places = {key: len(constants) + place for place, key in enumerate(keys)}
    first_image[graded] = [places[start] for start in starts]
    images = [Image(value) for value in constants.tolist()]
    step = defocus.accuracy.slope_step
    images += [Image(node / NODES_PER_PX, (step * x, step * y), node) for x, y, node in keys]
    return constant, first_image, count, tuple(images)


def _slopes(defocus: Defocus, layer_statistics: list[RadiusStatistics], held: np.ndarray, largest_px: np.ndarray) -> np.ndarray:
    """Slopes of the tiles in x and y, whole multiples of `Accuracy.slope_step`: (2, layers, tile rows, tile columns) int.

    held: blocks that count. largest_px: blur radius of each tile. A slope that would reach beyond the margin is less: no
    surface has such a radius. Where the slope changes inside a tile it is not told more exactly than a quarter of that: fewer
    images are needed.
    """
    names, (corner, step) = ("slope_x", "slope_y"), (defocus.pupil.corner_radius, defocus.accuracy.slope_step)
    slope, least, greatest = (
        np.stack([_over_blocks(layer_statistics, held, name, join) for name in names]) for join in (np.mean, np.min, np.max)
    )
    coarse = 2.0 ** np.ceil(np.log2(np.maximum(0.25 * (greatest - least).max(axis=0) / step, 1.0)))
    most = np.maximum((1.0 - largest_px * corner / (defocus.reach_px - 1.0)) / corner, 0.0)
    whole = np.rint(slope / (step * coarse)) * coarse
    length = step * np.hypot(*whole)
    return np.where(length > most, np.trunc(whole * most / np.maximum(length, 1e-9)), whole).astype(int)


def _over_blocks(layer_statistics: list[RadiusStatistics], held: np.ndarray, name: str, join) -> np.ndarray:
    """Least, greatest or mean value over the blocks of each tile that count: (layers, tile rows, tile columns)."""
    shape = (len(layer_statistics), held.shape[0] // ROWS_IN_TILE, ROWS_IN_TILE, -1, COLUMNS_IN_TILE)
    values = np.stack([getattr(radius_statistics, name) for radius_statistics in layer_statistics]).reshape(shape)
    counted = np.broadcast_to(held, (len(layer_statistics), *held.shape)).reshape(shape)
    if join is np.mean:
        return (values * counted).sum(axis=(2, 4)) / counted.sum(axis=(2, 4))
    return join(values, axis=(2, 4), where=counted, initial=np.inf if join is np.min else -np.inf)
