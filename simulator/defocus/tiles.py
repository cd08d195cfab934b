"""Which method each tile of a blurred frame gets, and which nodes of radius its means need."""

from dataclasses import dataclass

import numpy as np

from simulator.defocus import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    SAME_PX,
    SHARP_PX,
    STEEPEST_PX,
    TILE_COLUMNS,
    TILE_ROWS,
    Defocus,
    Method,
    Relief,
    seen_from,
)
from simulator.defocus.blocks import BlockChoice, even_radius

NODES_PER_PX = 2  # between two nodes the mean is a cubic in the radius
CONSTANT_NODES_PER_PX = 32  # radii at which a tile of one radius is computed
FINE_SCALE = 1.5  # scene pixels per photosite from which a scene has detail between photosites
FINE_PX = 12.0  # blur circles up to this radius do not wipe it out
ROWS_IN_TILE, COLUMNS_IN_TILE = TILE_ROWS // BLOCK_ROWS, TILE_COLUMNS // BLOCK_COLUMNS  # blocks


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile; arrays of (tile rows, tile columns), some with the layers as first axis.

    wanted: whether it is computed. methods: of Method; OCCLUSION where points of the aperture compute all of the tile.
    over: points per photosite and axis.
    visible: (layers, ...) whether a layer can be seen from the tile.
    constant: (layers, ...) whether one blur circle is enough; then first_node is an index into `constants`, radii [photosites].
    first_node, nodes: (layers, ...) otherwise nodes of 1 / NODES_PER_PX photosites of signed radius.
    blocks: what the tiles' blocks need in addition.
    zone: number of the upper left corner of zones around it (`zones.Zones`); -1 where no rim hides anything.
    """

    wanted: np.ndarray
    methods: np.ndarray
    over: np.ndarray
    visible: np.ndarray
    constant: np.ndarray
    first_node: np.ndarray
    nodes: np.ndarray
    constants: np.ndarray
    blocks: BlockChoice
    zone: np.ndarray

    def overs(self) -> list[int]:
        """Return the numbers of points per photosite and axis that occur."""
        return np.unique(self.over[self.wanted]).tolist()

    def part(self, rows: slice, over: int) -> "TileChoice":
        """Rows of tiles; wanted are those with this many points."""
        whole = ("constants", "blocks")
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items() if name not in whole}
        kept["wanted"] = kept["wanted"] & (kept["over"] == over)
        blocks = self.blocks.part(slice(rows.start * ROWS_IN_TILE, rows.stop * ROWS_IN_TILE), _each_block(kept["wanted"]))
        return TileChoice(**kept, constants=self.constants, blocks=blocks)

    def with_method(self, *methods: Method) -> np.ndarray:
        """Wanted tiles that get one of these methods."""
        return self.wanted & np.isin(self.methods, methods)

    def graded_nodes(self) -> tuple[int, int]:
        """First node and end of the nodes of all tiles that have more than one radius."""
        graded = ~self.constant & self.visible & self.with_method(Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
        return int(self.first_node[graded].min()), int((self.first_node + self.nodes)[graded].max())


def choose(defocus: Defocus, reliefs: list[Relief], wanted: np.ndarray) -> TileChoice:
    """Cheapest method for each tile, and each of its blocks, that keeps the error below the tolerance's.

    reliefs: of each layer's patches. wanted: (tile rows, tile columns) bool.
    """
    around = [seen_from(relief, defocus.pupil.corner_radius, defocus.largest_px) for relief in reliefs]
    tiles, blocks = ([getattr(seen, part)() for seen in around] for part in ("of_tiles", "of_blocks"))
    methods, visible, largest, single = _methods(tiles)
    block_methods, block_visible, block_largest, _ = _methods(blocks)
    hard = block_methods == Method.OCCLUSION
    some = (methods == Method.OCCLUSION) & ~_all_blocks(hard)
    methods = np.where(some, np.where(single, Method.MEAN, Method.COMPOSITE), methods)
    over = np.where((defocus.scale >= FINE_SCALE) & (largest <= FINE_PX) & (methods != Method.COPY), 2, 1)
    constant, first_node, nodes, constants = _nodes(defocus, [r.of_blocks() for r in reliefs], ~hard, visible & wanted)
    present = np.where(block_visible, np.stack([seen.classes for seen in blocks]), np.uint64(0))
    even = np.stack([even_radius(seen, block_methods) for seen in blocks])
    points = BlockChoice(_each_block(wanted), block_methods, block_largest, present, even)
    return TileChoice(wanted, methods, over, visible, constant, first_node, nodes, constants, points, np.full(over.shape, -1))


def _each_block(tiles: np.ndarray) -> np.ndarray:
    """A plane of tiles, as a plane of their blocks."""
    return tiles.repeat(ROWS_IN_TILE, axis=0).repeat(COLUMNS_IN_TILE, axis=1)


def _all_blocks(blocks: np.ndarray) -> np.ndarray:
    """Whether it holds for all blocks of each tile."""
    return blocks.reshape(blocks.shape[0] // ROWS_IN_TILE, ROWS_IN_TILE, -1, COLUMNS_IN_TILE).all(axis=(1, 3))


def _methods(around: list[Relief]) -> tuple[np.ndarray, ...]:
    """Method of each place, (layers, ...) whether a layer is visible, largest blur radius, whether one layer fills it."""
    visible, largest = _visible(around)
    smooth = (~visible | (np.stack([seen.steepest_px for seen in around]) <= STEEPEST_PX)).all(axis=0)
    single = (visible.sum(axis=0) == 1) & (~visible | (np.stack([seen.filled for seen in around]) >= 1.0)).all(axis=0)
    blurred = [np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px)) > SHARP_PX for seen in around]
    several = (visible & np.stack(blurred)).sum(axis=0) > 1
    cases = [(single & (largest <= SHARP_PX), Method.COPY), (single & smooth, Method.MEAN)]
    cases += [(smooth & ~several, Method.COMPOSITE), (smooth, Method.CORRECTED)]
    return np.select(*zip(*cases, strict=True), Method.OCCLUSION), visible, largest, single


def _visible(around: list[Relief]) -> tuple[np.ndarray, np.ndarray]:
    """Whether each layer can be seen from each place, and the largest blur circle's radius."""
    open_, largest, found = np.ones(around[0].least_px.shape, bool), np.zeros(around[0].least_px.shape), []
    for seen in around:
        visible = open_ & (seen.covered > 0.0)
        found.append(visible)
        reach = np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px))
        largest = np.where(visible, np.maximum(largest, reach), largest)
        open_ &= seen.filled < 1.0
    return np.stack(found), largest


def _nodes(defocus: Defocus, reliefs: list[Relief], kept: np.ndarray, needed: np.ndarray) -> tuple[np.ndarray, ...]:
    """Fields constant, first_node, nodes and constants of TileChoice.

    reliefs: of each layer's blocks. kept: blocks whose radii count. needed: (layers, tile rows, tile columns) bool.
    """
    split = (len(reliefs), kept.shape[0] // ROWS_IN_TILE, ROWS_IN_TILE, -1, COLUMNS_IN_TILE)
    held = kept | ~_each_block(~_all_blocks(~kept))  # tiles without any get some number
    least = np.stack([np.where(held, relief.least_px, np.inf) for relief in reliefs]).reshape(split).min(axis=(2, 4))
    greatest = np.stack([np.where(held, relief.greatest_px, -np.inf) for relief in reliefs]).reshape(split).max(axis=(2, 4))
    radius = np.rint(0.5 * (least + greatest) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    for layer, own in enumerate(defocus.radii_px):
        if np.ndim(own) == 0:
            radius[layer] = own
    constant = np.maximum(greatest - radius, radius - least) <= SAME_PX
    constants, index = np.unique(np.where(constant & needed, radius, 0.0), return_inverse=True)
    first, last = (np.floor(border * NODES_PER_PX).astype(int) for border in (least, greatest))
    first_node = np.where(constant, index.reshape(constant.shape), first - 1)
    return constant, first_node, np.where(constant, 1, last - first + 4), constants
