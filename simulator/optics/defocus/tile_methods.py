"""Chooses the blur method of each tile of a frame, and the images of the aperture that its means need."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from simulator.device.threads import in_threads
from simulator.optics.defocus.accuracy import product_error
from simulator.optics.defocus.aperture_mean_tables import Image
from simulator.optics.defocus.defocus import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    NODES_PER_PX,
    STEEPEST_PX,
    TILE_COLUMNS,
    TILE_ROWS,
    Defocus,
    Method,
    RadiusStatistics,
    merge_within_reach,
)
from simulator.optics.defocus.radius_slabs import BlockChoice, find_even_radius

CONSTANT_NODES_PER_PX = 32  # resolution of the radius of a tile that has a single one
ROWS_IN_TILE, COLUMNS_IN_TILE = TILE_ROWS // BLOCK_ROWS, TILE_COLUMNS // BLOCK_COLUMNS  # blocks


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile; arrays of (tile rows, tile columns), some with the layers as first axis.

    computed: whether the tile is computed. methods: values of Method; OCCLUSION where aperture samples compute the whole tile.
    samples_per_axis: samples per photosite and axis; 0: the tile is gathered from the scene's pixels (`scene_gather`).
    largest_px: largest radius of the blur circles that reach the tile [photosites].
    visible: (layers, ...) whether a layer is visible from the tile, that is, not fully occluded by nearer ones.
    constant: (layers, ...) whether one blur radius is exact enough.
    first_image, images: (layers, ...) where the tile's images of the aperture begin in `all_images`, and how many it has: one,
        or one for each 1 / Defocus.nodes_per_px photosites of signed radius; coarse: (layers, ...) for each 1 / NODES_PER_PX.
    blocks: choices of the tiles' blocks.
    zone: number of the upper left corner of the tile's zones (`field_zones.Zones`); -1 where no rim clips the pupil.
    """

    computed: np.ndarray
    methods: np.ndarray
    samples_per_axis: np.ndarray
    largest_px: np.ndarray
    visible: np.ndarray
    constant: np.ndarray
    first_image: np.ndarray
    images: np.ndarray
    coarse: np.ndarray
    all_images: tuple[Image, ...]
    blocks: BlockChoice
    zone: np.ndarray

    def sample_grids(self) -> list[int]:
        """Numbers of samples per photosite and axis that occur in computed tiles."""
        return [count for count in np.unique(self.samples_per_axis[self.computed]).tolist() if count]

    def part(self, rows: slice, samples_per_axis: int) -> "TileChoice":
        """Select rows of tiles; those with another number of samples per photosite and axis are not computed."""
        whole = ("all_images", "blocks")
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items() if name not in whole}
        kept["computed"] = kept["computed"] & (kept["samples_per_axis"] == samples_per_axis)
        blocks = self.blocks.part(slice(rows.start * ROWS_IN_TILE, rows.stop * ROWS_IN_TILE), each_block(kept["computed"]))
        return TileChoice(**kept, all_images=self.all_images, blocks=blocks)

    def without(self, tiles: np.ndarray) -> "TileChoice":
        """Return the choice in which these tiles (a mask) are not computed."""
        return replace(self, computed=self.computed & ~tiles)

    def left_out(self) -> np.ndarray:
        """Blocks of each tile whose light is no mean over the aperture's image: a bit each, row by row."""
        elsewhere = (self.blocks.methods == Method.OCCLUSION) | (self.blocks.methods == Method.WIDE)
        rows, columns = self.methods.shape
        of_tiles = elsewhere.reshape(rows, ROWS_IN_TILE, columns, COLUMNS_IN_TILE).swapaxes(1, 2).reshape(rows, columns, -1)
        return of_tiles @ (1 << np.arange(ROWS_IN_TILE * COLUMNS_IN_TILE))

    def tiles_of_blocks(self, blocks: np.ndarray) -> np.ndarray:
        """Mask of the tiles that hold any of these blocks (a mask)."""
        return _any_block(blocks)

    def tiles_with(self, *methods: Method) -> np.ndarray:
        """Mask of the computed tiles that have one of these methods."""
        return self.computed & reduce(np.logical_or, [self.methods == method for method in methods])

    def table(self) -> tuple[list[Image], np.ndarray]:
        """Images that the computed tiles need, and the index of each of `all_images` among them."""
        meant = self.visible & self.tiles_with(Method.COPY, Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
        needed = np.zeros(len(self.all_images) + 1, int)
        np.add.at(needed, self.first_image[meant], 1)
        np.add.at(needed, (self.first_image + self.images)[meant], -1)
        needed = np.cumsum(needed[:-1]) > 0
        return [self.all_images[index] for index in np.flatnonzero(needed)], np.cumsum(needed) - 1


def choose_methods(
    defocus: Defocus, layer_statistics: list[RadiusStatistics], computed: np.ndarray, margin: tuple[int, int]
) -> TileChoice:
    """Choose for each tile, and each of its blocks, the cheapest method whose error stays below the tolerance.

    layer_statistics: statistics of each layer's patches. computed: (tile rows, tile columns) bool, tiles to compute.
    margin: rows and columns of patches on each side of the tiles.
    """
    moved_px = 0.0 if defocus.motion is None else defocus.motion.reach_px(defocus.largest_px)

    def merge(seen: RadiusStatistics) -> RadiusStatistics:
        return merge_within_reach(seen, defocus.pupil.corner_radius, defocus.largest_px, moved_px).inside(*margin)

    around = in_threads(merge, layer_statistics)
    tiles, blocks = ([getattr(seen, part)() for seen in around] for part in ("of_tiles", "of_blocks"))
    methods, samples_per_axis, visible, largest, single = _classify(defocus, tiles)
    block_methods, _, block_visible, block_largest, block_single = _classify(defocus, blocks)
    hard = block_methods == Method.OCCLUSION
    wide = _smallest_radius(blocks, block_visible) >= defocus.wide_px
    some = (methods == Method.OCCLUSION) & ~_all_blocks(hard)
    visible &= ~some | _any_block(block_visible & ~hard)
    single |= some & _all_blocks(block_single | hard) & (visible.sum(axis=0) == 1)
    methods = np.where(some, np.where(single, Method.MEAN, Method.COMPOSITE), methods)
    samples_per_axis = np.where(methods == Method.COPY, 1, samples_per_axis)
    gathered = (methods == Method.MEAN) & ~some & defocus.gathers_scene(_smallest_radius(tiles, visible), largest)
    samples_per_axis = np.where(gathered, 0, samples_per_axis)
    own_blocks = [radius_statistics.inside(*margin).of_blocks() for radius_statistics in layer_statistics]
    images = _choose_images(defocus, own_blocks, ~hard, visible & computed & (methods != Method.OCCLUSION))
    present = np.where(block_visible, np.stack([seen.classes for seen in blocks]), np.uint64(0))
    even = np.stack([find_even_radius(defocus, seen, block_methods) for seen in blocks])
    block_methods = np.where(hard & wide, Method.WIDE, block_methods)
    points = BlockChoice(each_block(computed), block_methods, block_largest, present, even)
    return TileChoice(
        computed, methods, samples_per_axis, largest, visible, *images, points, np.full(samples_per_axis.shape, -1)
    )


def each_block(tiles: np.ndarray) -> np.ndarray:
    """Repeat the value of each tile for all its blocks."""
    return tiles.repeat(ROWS_IN_TILE, axis=0).repeat(COLUMNS_IN_TILE, axis=1)


def _any_block(blocks: np.ndarray) -> np.ndarray:
    """Whether the mask (..., block rows, block columns) is set for any block of each tile."""
    *layers, rows, _ = blocks.shape
    split = blocks.reshape(*layers, rows // ROWS_IN_TILE, ROWS_IN_TILE, -1, COLUMNS_IN_TILE)
    return np.logical_or.reduce(split, axis=(-3, -1))


def _all_blocks(blocks: np.ndarray) -> np.ndarray:
    """Whether the mask (..., block rows, block columns) is set for all blocks of each tile."""
    return ~_any_block(~blocks)


def _classify(defocus: Defocus, around: list[RadiusStatistics]) -> tuple[np.ndarray, ...]:
    """Method of each tile or block, samples per axis, visible layers, largest radius, and whether one opaque layer fills it."""
    accuracy, (visible, largest) = defocus.accuracy, _find_visible(around)
    smooth = (~visible | (np.stack([seen.steepest_px for seen in around]) <= STEEPEST_PX)).all(axis=0)
    single = (visible.sum(axis=0) == 1) & (~visible | (np.stack([seen.filled for seen in around]) >= 1.0)).all(axis=0)
    reach = np.stack([np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px)) for seen in around])
    several = (visible & (reach > accuracy.sharp_px)).sum(axis=0) > 1
    smallest, step = _smallest_radius(around, visible), float(accuracy.detail > 0.0)
    samples_per_axis = defocus.samples_per_axis(smallest, largest)
    is_product = ~several & (visible.sum(axis=0) > 1) & (product_error(largest, step) > accuracy.allowed)
    if step:  # wide circles take samples enough for the edges of what has smaller ones beside them
        samples_per_axis = np.where(is_product | several, defocus.samples_per_axis(smallest, smallest), samples_per_axis)
    samples_per_axis = np.maximum(samples_per_axis, min(defocus.wider, 4))  # edges stay where the camera's photosites show them
    apart = ~several & ((samples_per_axis == 1) | ~is_product)
    conditions = [single & (largest <= defocus.copied_px), single & smooth, smooth & apart, smooth]
    methods = [Method.COPY, Method.MEAN, Method.COMPOSITE, Method.CORRECTED]
    chosen = np.select(conditions, methods, Method.OCCLUSION)
    if defocus.motion is not None:  # only samples of the aperture carry instants
        chosen = np.full_like(chosen, Method.OCCLUSION)
    return chosen, samples_per_axis, visible, largest, single


def _smallest_radius(around: list[RadiusStatistics], visible: np.ndarray) -> np.ndarray:
    """Smallest blur radius of the surfaces visible from each tile; 0 where one is in focus."""
    least = [np.maximum(np.maximum(seen.least_px, -seen.greatest_px), 0.0) for seen in around]
    return np.where(visible, np.stack(least), np.inf).min(axis=0)


def _find_visible(around: list[RadiusStatistics]) -> tuple[np.ndarray, np.ndarray]:
    """Which layers are visible from each tile or block, and the largest blur radius of those."""
    open_, largest, visible_layers = np.ones(around[0].least_px.shape, bool), np.zeros(around[0].least_px.shape), []
    for seen in around:
        visible = open_ & (seen.covered > 0.0)
        visible_layers.append(visible)
        reach = np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px))
        largest = np.where(visible, np.maximum(largest, reach), largest)
        open_ &= (seen.filled < 1.0) | (seen.steepest_px > STEEPEST_PX)  # rays pass between the two sides of a step in depth
    return np.stack(visible_layers), largest


def _choose_images(
    defocus: Defocus, layer_statistics: list[RadiusStatistics], kept: np.ndarray, needed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, tuple[Image, ...]]:
    """Fields constant, first_image, images, coarse and all_images of TileChoice; tiles that are not needed get no images.

    layer_statistics: statistics of each layer's blocks. kept: blocks whose radii count.
    needed: (layers, tile rows, tile columns) bool.
    """
    held = kept | ~each_block(~_all_blocks(~kept))  # a tile without any counts all its blocks, so that its values are finite
    least, greatest = (
        _over_blocks(layer_statistics, held, "least_px", np.min),
        _over_blocks(layer_statistics, held, "greatest_px", np.max),
    )
    radius = np.rint(0.5 * (least + greatest) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    for layer, own in enumerate(defocus.radii_px):
        if np.ndim(own) == 0:
            radius[layer] = own
    constant = np.maximum(greatest - radius, radius - least) <= defocus.accuracy.same_px_at(radius)
    coarse = ~constant & defocus.is_coarse(least, greatest)
    per_px = np.where(coarse, NODES_PER_PX, defocus.nodes_per_px)
    first, last = np.floor(least * per_px).astype(int) - 1, np.floor(greatest * per_px).astype(int) + 2
    slopes = _slopes(defocus, layer_statistics, held, np.maximum(-first, last) / per_px)
    one, graded = needed & constant, needed & ~constant
    constants, index = np.unique(radius[one], return_inverse=True)
    first_image, count = np.zeros(constant.shape, int), np.zeros(constant.shape, int)
    first_image[one], count[one] = index, 1
    count[graded] = (last - first + 1)[graded]
    keys, starts = _join_runs(np.stack([per_px, *slopes, first])[:, graded], count[graded])
    first_image[graded] = len(constants) + starts
    images = [Image(value) for value in constants.tolist()]
    step = defocus.accuracy.slope_step
    images += [Image(node / rate, (step * x, step * y), node) for rate, x, y, node in keys.T.tolist()]
    return constant, first_image, count, coarse, tuple(images)


def _join_runs(runs: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sorted keys (fields, keys) of all runs, and the place of each run's first key among them, (runs,).

    runs: (fields, runs) int, the first key of each, whose last field counts up. counts: (runs,) of its keys, 1 or more.
    """
    if not runs.size:
        return runs, np.zeros(0, int)
    least = runs.min(axis=1)
    sizes = runs.max(axis=1) - least + 1
    sizes[-1] += counts.max()
    starts = np.ravel_multi_index(tuple(runs - least[:, None]), tuple(sizes))
    pairs = np.unique(np.stack([starts, counts]), axis=1)
    every = np.repeat(pairs[0], pairs[1]) + np.arange(pairs[1].sum()) - np.repeat(np.cumsum(pairs[1]) - pairs[1], pairs[1])
    keys = np.unique(every)
    return np.stack(np.unravel_index(keys, tuple(sizes))) + least[:, None], np.asarray(np.searchsorted(keys, starts))


def _slopes(defocus: Defocus, layer_statistics: list[RadiusStatistics], held: np.ndarray, largest_px: np.ndarray) -> np.ndarray:
    """Slopes of the tiles in x and y, whole multiples of `Accuracy.slope_step`: (2, layers, tile rows, tile columns) int.

    held: blocks that count. largest_px: largest blur radius of each tile. Slopes are limited to those of continuous surfaces,
    and so that the blur stays within the margin. Where the slope varies inside a tile, it is rounded to a quarter of its range,
    so that tiles share images.
    """
    names, (corner, step) = ("slope_x", "slope_y"), (defocus.pupil.corner_radius, defocus.accuracy.slope_step)
    slope, least, greatest = (
        np.stack([_over_blocks(layer_statistics, held, name, join) for name in names]) for join in (np.mean, np.min, np.max)
    )
    coarse = 2.0 ** np.ceil(np.log2(np.maximum(0.25 * (greatest - least).max(axis=0) / step, 1.0)))
    slope = np.clip(slope, -STEEPEST_PX, STEEPEST_PX)
    most = np.maximum((1.0 - largest_px * corner / (defocus.reach_px - 1.0)) / corner, 0.0)
    whole = np.rint(slope / (step * coarse)) * coarse
    length = step * np.hypot(*whole)
    return np.where(length > most, np.trunc(whole * most / np.maximum(length, 1e-9)), whole).astype(int)


def _over_blocks(
    layer_statistics: list[RadiusStatistics], held: np.ndarray, name: str, join: Callable[..., np.ndarray]
) -> np.ndarray:
    """Least, greatest or mean value over the blocks of each tile that count: (layers, tile rows, tile columns)."""
    shape = (len(layer_statistics), held.shape[0] // ROWS_IN_TILE, ROWS_IN_TILE, -1, COLUMNS_IN_TILE)
    values = np.stack([getattr(radius_statistics, name) for radius_statistics in layer_statistics]).reshape(shape)
    counted = np.broadcast_to(held, (len(layer_statistics), *held.shape)).reshape(shape)
    if join is np.mean:
        return (values * counted).sum(axis=(2, 4)) / counted.sum(axis=(2, 4))
    return join(values, axis=(2, 4), where=counted, initial=np.inf if join is np.min else -np.inf)
