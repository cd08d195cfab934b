"""Which method each tile of a blurred frame gets, and the lists that the kernels work through."""

from dataclasses import dataclass

import numpy as np

from simulator.defocus import CLASSES, SAME_PX, SHARP_PX, STEEPEST_PX, Defocus, Method, Relief, seen_from

NODES_PER_PX = 2  # between two nodes the mean is a cubic in the radius
CONSTANT_NODES_PER_PX = 32  # radii at which a tile of one radius is computed
FINE_SCALE = 1.5  # scene pixels per photosite from which a scene has detail between photosites
FINE_PX = 12.0  # blur circles up to this radius do not wipe it out


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile; arrays of (tile rows, tile columns), some with the layers as first axis.

    wanted: whether it is computed. methods: of Method. over: points per photosite and axis.
    largest_px: largest blur circle's radius that reaches the tile.
    present: (layers, ...) classes of radii that occur around the tile; 0 where the layer is hidden or absent.
    constant: (layers, ...) whether one blur circle is enough; then first_node is an index into `constants`, radii [photosites].
    first_node, nodes: (layers, ...) otherwise nodes of 1 / NODES_PER_PX photosites of signed radius.
    """

    wanted: np.ndarray
    methods: np.ndarray
    over: np.ndarray
    largest_px: np.ndarray
    present: np.ndarray
    constant: np.ndarray
    first_node: np.ndarray
    nodes: np.ndarray
    constants: np.ndarray

    def overs(self) -> list[int]:
        """Return the numbers of points per photosite and axis that occur."""
        return np.unique(self.over[self.wanted]).tolist()

    def part(self, rows: slice, over: int) -> "TileChoice":
        """Rows of tiles; wanted are those with this many points."""
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items() if name != "constants"}
        kept["wanted"] = kept["wanted"] & (kept["over"] == over)
        return TileChoice(**kept, constants=self.constants)

    def with_method(self, *methods: Method) -> np.ndarray:
        """Wanted tiles that get one of these methods."""
        return self.wanted & np.isin(self.methods, methods)

    def graded_nodes(self) -> tuple[int, int]:
        """First node and end of the nodes of all tiles that have more than one radius."""
        graded = ~self.constant & (self.present > 0) & self.with_method(Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
        return int(self.first_node[graded].min()), int((self.first_node + self.nodes)[graded].max())


def choose(defocus: Defocus, reliefs: list[Relief], wanted: np.ndarray) -> TileChoice:
    """Cheapest method for each tile that keeps the error below the tolerance's.

    reliefs: of each layer's patches. wanted: (tile rows, tile columns) bool.
    """
    around = [seen_from(relief, defocus.pupil.corner_radius) for relief in reliefs]
    present, largest = _visible(around)
    visible = present > 0
    smooth = (~visible | (np.stack([seen.steepest_px for seen in around]) <= STEEPEST_PX)).all(axis=0)
    single = (visible.sum(axis=0) == 1) & (~visible | (np.stack([seen.filled for seen in around]) >= 1.0)).all(axis=0)
    blurred = [np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px)) > SHARP_PX for seen in around]
    several = (visible & np.stack(blurred)).sum(axis=0) > 1
    cases = [(single & (largest <= SHARP_PX), Method.COPY), (single & smooth, Method.MEAN)]
    cases += [(smooth & ~several, Method.COMPOSITE), (smooth, Method.CORRECTED)]
    methods = np.select(*zip(*cases, strict=True), Method.OCCLUSION)
    over = np.where((defocus.scale >= FINE_SCALE) & (largest <= FINE_PX) & (methods != Method.COPY), 2, 1)
    constant, first_node, nodes, constants = _nodes(defocus, [relief.of_tiles() for relief in reliefs], visible & wanted)
    return TileChoice(wanted, methods, over, largest, present, constant, first_node, nodes, constants)


def _visible(around: list[Relief]) -> tuple[np.ndarray, np.ndarray]:
    """Classes of each layer that can be seen from each tile, and the largest blur circle's radius."""
    open_, largest, present = np.ones(around[0].least_px.shape, bool), np.zeros(around[0].least_px.shape), []
    for seen in around:
        visible = open_ & (seen.covered > 0.0)
        present.append(np.where(visible, seen.classes, np.uint64(0)))
        reach = np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px))
        largest = np.where(visible, np.maximum(largest, reach), largest)
        open_ &= seen.filled < 1.0
    return np.stack(present), largest


def _nodes(defocus: Defocus, reliefs: list[Relief], needed: np.ndarray) -> tuple[np.ndarray, ...]:
    """Fields constant, first_node, nodes and constants of TileChoice."""
    least, greatest = (np.stack([getattr(relief, name) for relief in reliefs]) for name in ("least_px", "greatest_px"))
    radius = np.rint(0.5 * (least + greatest) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    for layer, own in enumerate(defocus.radii_px):
        if np.ndim(own) == 0:
            radius[layer] = own
    constant = np.maximum(greatest - radius, radius - least) <= SAME_PX
    constants, index = np.unique(np.where(constant & needed, radius, 0.0), return_inverse=True)
    first, last = (np.floor(border * NODES_PER_PX).astype(int) for border in (least, greatest))
    first_node = np.where(constant, index.reshape(constant.shape), first - 1)
    return constant, first_node, np.where(constant, 1, last - first + 4), constants


def slab_lists(defocus: Defocus, present: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slabs for tiles, (slabs, 5) float32 as kernels/occlusion.cl has them, and each tile's first and count.

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
    return np.array(slabs, np.float32).reshape(-1, 5), np.array(first)[index], np.array(count)[index]


def _slabs(defocus: Defocus, classes: np.ndarray) -> list[tuple[float, ...]]:
    entries, maps = [], 0
    for layer, radius in enumerate(defocus.radii_px):
        mapped = np.ndim(radius) > 0
        if classes[layer] and not mapped:
            entries.append((layer, -1, radius, radius, radius))
        elif classes[layer]:
            held = int(classes[layer])
            held |= held >> 1  # with a phase of 0 to 1, a class lies in its own slab or the one before
            numbers = [bit for bit in range(CLASSES) if held >> bit & 1]
            entries += [(layer, maps, *(defocus.class_border_px(number + i) for i in range(3))) for number in numbers]
        maps += mapped
    return sorted(entries, key=lambda slab: (slab[0], slab[2]))
