"""Which method each tile of a blurred frame gets, and the lists that the kernels work through."""

from dataclasses import dataclass

import numpy as np

from simulator.defocus import CLASSES, STEEPEST_PX, Defocus, Method, Relief, seen_from
from simulator.defocus.accuracy import product_error
from simulator.defocus.tables import Image

NODES_PER_PX = 2  # between two nodes the mean is a cubic in the radius
CONSTANT_NODES_PER_PX = 32  # radii at which a tile of one radius is computed


@dataclass(frozen=True)
class TileChoice:
    """Method of each tile; arrays of (tile rows, tile columns), some with the layers as first axis.

    wanted: whether it is computed. methods: of Method. over: points per photosite and axis.
    largest_px: largest blur circle's radius that reaches the tile.
    present: (layers, ...) classes of radii that occur around the tile; 0 where the layer is hidden or absent.
    constant: (layers, ...) whether one blur circle is enough.
    first_image, images: (layers, ...) where the tile's images of the aperture begin in `all_images`, and how many it has: one,
        or one for each 1 / NODES_PER_PX photosites of signed radius.
    """

    wanted: np.ndarray
    methods: np.ndarray
    over: np.ndarray
    largest_px: np.ndarray
    present: np.ndarray
    constant: np.ndarray
    first_image: np.ndarray
    images: np.ndarray
    all_images: tuple[Image, ...]

    def overs(self) -> list[int]:
        """Return the numbers of points per photosite and axis that occur."""
        return np.unique(self.over[self.wanted]).tolist()

    def part(self, rows: slice, over: int) -> "TileChoice":
        """Rows of tiles; wanted are those with this many points."""
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items() if name != "all_images"}
        kept["wanted"] = kept["wanted"] & (kept["over"] == over)
        return TileChoice(**kept, all_images=self.all_images)

    def with_method(self, *methods: Method) -> np.ndarray:
        """Wanted tiles that get one of these methods."""
        return self.wanted & np.isin(self.methods, methods)

    def table(self) -> tuple[list[Image], np.ndarray]:
        """Images that wanted tiles need, and the place of each of `all_images` among them."""
        meant = (self.present > 0) & self.with_method(Method.COPY, Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
        needed = np.zeros(len(self.all_images) + 1, int)
        np.add.at(needed, self.first_image[meant], 1)
        np.add.at(needed, (self.first_image + self.images)[meant], -1)
        needed = np.cumsum(needed[:-1]) > 0
        return [self.all_images[index] for index in np.flatnonzero(needed)], np.cumsum(needed) - 1


def choose(defocus: Defocus, reliefs: list[Relief], wanted: np.ndarray) -> TileChoice:
    """Cheapest method for each tile that keeps the error below the tolerance's.

    reliefs: of each layer's patches. wanted: (tile rows, tile columns) bool.
    """
    around = [seen_from(relief, defocus.pupil.corner_radius) for relief in reliefs]
    present, largest = _visible(around)
    visible = present > 0
    smooth = (~visible | (np.stack([seen.steepest_px for seen in around]) <= STEEPEST_PX)).all(axis=0)
    single = (visible.sum(axis=0) == 1) & (~visible | (np.stack([seen.filled for seen in around]) >= 1.0)).all(axis=0)
    accuracy, reach = defocus.accuracy, [np.maximum(np.abs(seen.least_px), np.abs(seen.greatest_px)) for seen in around]
    several = (visible & (np.stack(reach) > accuracy.sharp_px)).sum(axis=0) > 1
    over = accuracy.over(_smallest(around, visible), largest, defocus.scale)
    apart = ~several & ((over == 1) | (product_error(largest) <= accuracy.allowed))
    cases = [(single & (largest <= accuracy.sharp_px), Method.COPY), (single & smooth, Method.MEAN)]
    cases += [(smooth & apart, Method.COMPOSITE), (smooth, Method.CORRECTED)]
    methods = np.select(*zip(*cases, strict=True), Method.OCCLUSION)
    over = np.where(methods == Method.COPY, 1, over)
    bend = np.stack([relief.bend() for relief in reliefs])
    images = _images(defocus, [relief.of_tiles() for relief in reliefs], bend, visible & wanted)
    return TileChoice(wanted, methods, over, largest, present, *images)


def _smallest(around: list[Relief], visible: np.ndarray) -> np.ndarray:
    """Radius of the smallest blur circle of a surface that can be seen from each tile; 0 where one is in focus."""
    least = [np.maximum(np.maximum(seen.least_px, -seen.greatest_px), 0.0) for seen in around]
    return np.where(visible, np.stack(least), np.inf).min(axis=0)


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


def _images(defocus: Defocus, reliefs: list[Relief], bend: np.ndarray, needed: np.ndarray) -> tuple:
    """Fields constant, first_image, images and all_images of TileChoice; tiles that are not needed get none."""
    least, greatest = (np.stack([getattr(relief, name) for relief in reliefs]) for name in ("least_px", "greatest_px"))
    radius = np.rint(0.5 * (least + greatest) * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX
    for layer, own in enumerate(defocus.radii_px):
        if np.ndim(own) == 0:
            radius[layer] = own
    constant = np.maximum(greatest - radius, radius - least) <= defocus.accuracy.same_px
    first, last = np.floor(least * NODES_PER_PX).astype(int) - 1, np.floor(greatest * NODES_PER_PX).astype(int) + 2
    slopes = _slopes(defocus, reliefs, bend, np.maximum(-first, last) / NODES_PER_PX)
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


def _slopes(defocus: Defocus, reliefs: list[Relief], bend: np.ndarray, largest_px: np.ndarray) -> np.ndarray:
    """Slopes of the tiles in x and y, whole multiples of `Accuracy.slope_step`: (2, layers, tile rows, tile columns) int.

    largest_px: blur radius of each tile. A slope that would reach beyond the margin is less: no surface has such a radius.
    A tile whose slope changes inside it, by `bend`, is not told more exactly than a quarter of that: fewer images are needed.
    """
    slope = np.stack([np.stack([getattr(relief, name) for relief in reliefs]) for name in ("slope_x", "slope_y")])
    corner, step = defocus.pupil.corner_radius, defocus.accuracy.slope_step
    most = np.maximum((1.0 - largest_px * corner / (defocus.reach_px - 1.0)) / corner, 0.0)
    coarse = 2.0 ** np.ceil(np.log2(np.maximum(0.25 * bend / step, 1.0)))
    whole = np.rint(slope / (step * coarse)) * coarse
    length = step * np.hypot(*whole)
    return np.where(length > most, np.trunc(whole * most / np.maximum(length, 1e-9)), whole).astype(int)


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
