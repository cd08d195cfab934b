"""Which method each tile of a blurred frame gets, and the lists that the kernels work through."""

from dataclasses import dataclass

import numpy as np

from simulator.defocus import CLASSES, SAME_PX, SHARP_PX, STEEPEST_PX, Defocus, Method, Relief, seen_from

NODES_PER_PX = 2  # between two nodes the mean is a cubic in the radius
CONSTANT_NODES_PER_PX = 32  # radii at which a tile of one radius is computed
FINE_SCALE = 0.75  # scene pixels per photosite from which a scene has detail between photosites
FINE_PX = 6.0  # blur circles up to this radius do not wipe it out


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile, (tile rows, tile columns) each.

    wanted: whether it is computed. methods: of Method. over: points per photosite and axis.
    layer: the surface that fills the tile's surroundings, for COPY and MEAN.
    constant: whether one blur circle is enough; then first_node is an index into `constants`, radii [photosites].
    first_node, nodes: otherwise nodes of 1 / NODES_PER_PX photosites of signed radius.
    largest_px: largest blur circle's radius that reaches the tile.
    present: (layers, tile rows, tile columns) classes of radii that occur around the tile; 0 where the layer is hidden or absent.
    """

    wanted: np.ndarray
    methods: np.ndarray
    over: np.ndarray
    layer: np.ndarray
    constant: np.ndarray
    first_node: np.ndarray
    nodes: np.ndarray
    largest_px: np.ndarray
    present: np.ndarray
    constants: np.ndarray

    def overs(self) -> list[int]:
        """Return the numbers of points per photosite and axis that occur."""
        return np.unique(self.over[self.wanted]).tolist()

    def part(self, rows: slice, over: int) -> "TileChoice":
        """Rows of tiles; wanted are those with this many points."""
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items() if name != "constants"}
        kept["wanted"] = kept["wanted"] & (kept["over"] == over)
        return TileChoice(**kept, constants=self.constants)

    def graded_nodes(self, over: int) -> tuple[int, int]:
        """First node and end of the nodes of tiles with more than one radius."""
        graded = self.wanted & (self.over == over) & (self.methods == Method.MEAN) & ~self.constant
        return int(self.first_node[graded].min()), int((self.first_node + self.nodes)[graded].max())


def choose(defocus: Defocus, scale: float, reliefs: list[Relief], wanted: np.ndarray) -> TileChoice:
    """Cheapest method for each tile that keeps the error below the tolerance's.

    scale: scene pixels per photosite. wanted: (tile rows, tile columns) bool.
    """
    around = [seen_from(relief) for relief in reliefs]
    layer, present, largest = _visible(around)
    single = (present > 0).sum(axis=0) == 1
    single &= _of_layer([seen.filled for seen in around], layer) >= 1.0
    smooth = _of_layer([seen.steepest_px for seen in around], layer) <= STEEPEST_PX
    sharp = largest <= SHARP_PX
    methods = np.select([single & sharp, single & smooth], [Method.COPY, Method.MEAN], Method.OCCLUSION)
    fine = (scale >= FINE_SCALE) & (largest <= FINE_PX) & (methods != Method.COPY)
    least, greatest = (_of_layer([getattr(relief, name) for relief in reliefs], layer) for name in ("least_px", "greatest_px"))
    radii = _constant_radius(defocus, layer, least, greatest)
    constant = np.maximum(greatest - radii, radii - least) <= SAME_PX
    constants, index = np.unique(
        np.where(constant & wanted & (methods == Method.MEAN), np.abs(radii), 0.0), return_inverse=True
    )
    first, last = (np.floor(border * NODES_PER_PX).astype(int) for border in (least, greatest))
    first_node = np.where(constant, index.reshape(constant.shape), first - 1)
    nodes = np.where(constant, 1, last - first + 4)
    over = np.where(fine, 2, 1)
    return TileChoice(wanted, methods, over, layer, constant, first_node, nodes, largest, present, constants)


def _visible(around: list[Relief]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nearest layer of each tile, the classes of each layer that can be seen, and the largest blur circle's radius."""
    shape = around[0].least_px.shape
    open_, layer, largest, present = np.ones(shape, bool), np.full(shape, len(around)), np.zeros(shape), []
    for index, seen in enumerate(around):
        visible = open_ & (seen.covered > 0.0)
        present.append(np.where(visible, seen.classes, np.uint64(0)))
        reach = np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px))
        largest = np.where(visible, np.maximum(largest, reach), largest)
        layer = np.where(visible, np.minimum(layer, index), layer)
        open_ &= seen.filled < 1.0
    return np.where(layer == len(around), 0, layer), np.stack(present), largest


def _constant_radius(defocus: Defocus, layer: np.ndarray, least: np.ndarray, greatest: np.ndarray) -> np.ndarray:
    """Signed radius that stands for a tile's: the layer's own where it has one, else the nearest of a fixed grid."""
    grid = np.rint(0.5 * (least + greatest) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    whole = np.array([np.ndim(radius) == 0 for radius in defocus.radii_px])[layer]
    exact = np.array([float(np.min(radius)) for radius in defocus.radii_px])[layer]
    return np.where(whole, exact, grid)


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
