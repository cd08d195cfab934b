"""Which method each tile of a blurred frame gets, and the lists that the kernels work through."""

from dataclasses import dataclass

import numpy as np

from simulator.defocus import CLASSES, SAME_PX, SHARP_PX, STEEPEST_PX, Defocus, Method, Relief, seen_from

NODES_PER_PX = 2  # between two nodes the mean is a cubic in the radius
CONSTANT_NODES_PER_PX = 32  # radii at which a tile of one radius is computed


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile, (tile rows, tile columns) each.

    methods: of Method. layer: the surface that fills the tile's surroundings, for COPY and MEAN.
    least_px, greatest_px: signed radius of that surface in the tile. constant: whether one blur circle is enough.
    largest_px: largest blur circle's radius that reaches the tile.
    present: (layers, tile rows, tile columns) classes of radii that occur around the tile; 0 where the layer is hidden or absent.
    """

    methods: np.ndarray
    layer: np.ndarray
    least_px: np.ndarray
    greatest_px: np.ndarray
    constant: np.ndarray
    largest_px: np.ndarray
    present: np.ndarray


def choose(defocus: Defocus, reliefs: list[Relief]) -> TileChoice:
    """Cheapest method for each tile that keeps the error below the tolerance's."""
    around = [seen_from(relief) for relief in reliefs]
    shape = reliefs[0].least_px.shape
    open_, layer = np.ones(shape, bool), np.full(shape, -1)
    present, largest, count = [], np.zeros(shape), np.zeros(shape, int)
    for index, seen in enumerate(around):
        visible = open_ & (seen.covered > 0.0)
        present.append(np.where(visible, seen.classes, np.uint64(0)))
        reach = np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px))
        largest = np.where(visible, np.maximum(largest, reach), largest)
        count += visible
        layer = np.where(visible & (layer < 0), index, layer)
        open_ &= seen.filled < 1.0
    layer = np.maximum(layer, 0)
    own = {name: _of_layer([getattr(r, name) for r in reliefs], layer) for name in ("least_px", "greatest_px")}
    filled, steepest = (_of_layer([getattr(a, name) for a in around], layer) for name in ("filled", "steepest_px"))
    single = (count == 1) & (filled >= 1.0) & (steepest <= STEEPEST_PX)
    methods = np.where(largest <= SHARP_PX, np.where(single | (count == 1) & (filled >= 1.0), Method.COPY, Method.OCCLUSION), Method.OCCLUSION)
    methods = np.where(single & (largest > SHARP_PX), Method.MEAN, methods)
    middle = np.rint(0.5 * (own["least_px"] + own["greatest_px"]) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    constant = np.maximum(own["greatest_px"] - middle, middle - own["least_px"]) <= SAME_PX
    return TileChoice(methods, layer, own["least_px"], own["greatest_px"], constant, largest, np.stack(present))


def _of_layer(planes: list[np.ndarray], layer: np.ndarray) -> np.ndarray:
    return np.take_along_axis(np.stack(planes), layer[None], axis=0)[0]


def slab_lists(defocus: Defocus, present: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slabs front to back for tiles: slabs (slabs, 4) float32 as kernels/occlusion.cl has them, and each tile's first and count.

    present: (layers, tiles) uint64. Tiles that hold the same classes share a list.
    """
    lists, index = np.unique(present, axis=1, return_inverse=True)
    slabs, first, count = [], [], []
    for classes in lists.T:
        entries = _slabs(defocus, classes)
        first.append(len(slabs))
        count.append(len(entries))
        slabs.extend(entries)
    index = index.reshape(-1)
    return np.array(slabs, np.float32).reshape(-1, 4), np.array(first)[index], np.array(count)[index]


def _slabs(defocus: Defocus, classes: np.ndarray) -> list[tuple[float, float, float, float]]:
    entries, maps = [], 0
    for layer, radius in enumerate(defocus.radii_px):
        mapped = np.ndim(radius) > 0
        if classes[layer] and not mapped:
            entries.append((layer, -1.0, radius, 0.0))
        elif classes[layer]:
            held = int(classes[layer])
            held |= held >> 1  # with a phase of 0 to 1, a class lies in its own slab or the one before
            middles = [defocus.least_px + (bit - 0.5) * defocus.class_step_px for bit in range(CLASSES) if held >> bit & 1]
            entries += [(layer, float(maps), middle, defocus.class_step_px) for middle in middles]
        maps += mapped
    return sorted(entries, key=lambda slab: (slab[2], slab[0]))
