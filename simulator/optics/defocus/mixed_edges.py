"""Where edges of layers that shift apart cross photosites, so that what is behind them shows through a part of each.

A photosite's light is the mean over its area of coverage times what lies behind. The product of their means lacks the
covariance of both, which is at most a quarter of the product of their ranges within the photosite (Popoviciu's and Cauchy and
Schwarz' inequalities), and nothing where coverage is even: there means are enough.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.geometry.projection import Projection
from simulator.scene.bands import least_of_bands, most_of_bands
from simulator.scene.scene import Scene

LEFT_SHARE = 0.1  # of the tolerance that differences of coverage may cause which count as even
BLOCK_PX = 16  # side of blocks of a layer that are searched for edges [px of the scene]
CELL_NS, SUM_NS = 0.047, 0.4  # of a plane of a cell; of a pixel of a photosite and column of cells
SPAN, WIDE = 64, 128  # photosites of a row and colour that are computed together; columns of two spans
SMALL_PX = 0.5  # blur radius up to which an edge stays within a photosite; laws of points hold the covariance of others
BLOCKS_SEEN = 4  # by a photosite at most, across whose borders coverage may change by more than within one


@dataclass(frozen=True)
class LayerEdges:
    """Blocks of layers with edges.

    blocks: by the layer's number, (rows, columns) bool, of layers with any. sigma: error at most where coverage counts as even
    [standard deviations of the noise].
    """

    blocks: dict[int, np.ndarray]
    sigma: float

    @property
    def are_seen(self) -> bool:
        """Whether there are any."""
        return bool(self.blocks)


def find_edges(scene: Scene, layers: int, weights: np.ndarray, accuracy: Accuracy) -> LayerEdges:
    """Return where edges lie in the first of so many layers, whose light is seen within LEFT_SHARE of the tolerance.

    weights: (bands, channels) of scene planes in electron radiance. accuracy: of the scene's brightest light.
    """
    worst = 0.25 * light_range(scene, layers, weights) * accuracy.electrons_per_radiance / max(accuracy.read_noise_e, 1.0)
    even = LEFT_SHARE * accuracy.tolerance / (worst * BLOCKS_SEEN) if worst > 0.0 else 1.0
    blocks, sigma = {}, 0.0
    for number, layer in enumerate(scene.layers[: layers - 1]):
        assert layer.coverage is not None  # else no layer behind it is seen
        changes = block_changes(layer.coverage)
        sigma = max(sigma, BLOCKS_SEEN * worst * float(changes[changes <= even].max(initial=0.0)))
        if (changes > even).any():
            blocks[number] = changes > even
    return LayerEdges(blocks, sigma)


def light_range(scene: Scene, layers: int, weights: np.ndarray) -> float:
    """Range of the light behind the nearest of so many layers, at most [electron radiance]."""
    *between, last = scene.layers[1:layers]
    most = sum(most_of_bands(layer.planes) @ weights for layer in (*between, last))
    least = 0.0 if between else least_of_bands(last.planes) @ weights
    return float(np.max(most - least))


def block_changes(coverage: np.ndarray) -> np.ndarray:
    """Largest difference of coverage (height, width) in each block and the pixels beyond it, (rows, columns)."""
    least = most = coverage
    for axis in (1, 0):
        least, most = _along(least, np.minimum, axis), _along(most, np.maximum, axis)
    return most - least


def _along(values: np.ndarray, choose: np.ufunc, axis: int) -> np.ndarray:
    """Least or greatest values (height, width) of blocks along an axis, with the first one after each."""
    blocks = np.arange(0, values.shape[axis], BLOCK_PX)
    beyond = np.minimum(blocks + BLOCK_PX, values.shape[axis] - 1)
    return choose(choose.reduceat(values, blocks, axis=axis), np.take(values, beyond, axis=axis))


def is_crossed(blocks: np.ndarray, left: np.ndarray, right: np.ndarray, top: np.ndarray, bottom: np.ndarray) -> np.ndarray:
    """Whether rectangles of a layer's pixels touch a block with an edge.

    blocks: of `LayerEdges`. left, right, top, bottom: sides [px], which broadcast to the result. Beyond the layer its edge
    pixels continue.
    """
    sums = np.zeros((blocks.shape[0] + 1, blocks.shape[1] + 1), np.int64)
    np.cumsum(np.cumsum(blocks, axis=0), axis=1, out=sums[1:, 1:])
    first_x, last_x, first_y, last_y = (
        np.clip(np.floor(side / BLOCK_PX).astype(np.int64), 0, count - 1)
        for side, count in zip((left, right, top, bottom), np.repeat(blocks.shape[::-1], 2).tolist(), strict=True)
    )
    found = sums[last_y + 1, last_x + 1] - sums[first_y, last_x + 1] - sums[last_y + 1, first_x] + sums[first_y, first_x]
    return found > 0


def crossed_spans(
    edges: LayerEdges,
    projection: Projection,
    least: np.ndarray,
    most: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    over: int,
) -> np.ndarray:
    """Whether an edge of a layer lies in what WIDE samples of a row see at any instant, (rows, columns).

    least, most: (rows or 1, layers, 2) x, y of layers' ways [photosites]. rows, columns: of the first samples of WIDE on the
    sensor. over: samples per photosite and axis. Samples smaller than a pixel see as far as one beside them.
    """
    found, scale = np.zeros((len(rows), len(columns)), bool), projection.scale / over
    beside, least, most = max(1.0 - scale, 0.0), projection.scale * least, projection.scale * most
    for layer, blocks in edges.blocks.items():
        left = projection.offset_x + scale * columns[None, :] + least[:, layer, :1] - beside
        right = projection.offset_x + scale * (columns[None, :] + WIDE) + most[:, layer, :1] + beside
        top = projection.offset_y + scale * rows[:, None] + least[:, layer, 1:] - beside
        bottom = projection.offset_y + scale * (rows[:, None] + 1) + most[:, layer, 1:] + beside
        found |= is_crossed(blocks, left, right, top, bottom)
    return found


def crossed_share(path_px: float, over: int) -> float:
    """Part of the largest covariance at an edge that is left of samples, `over` per photosite and axis, on its way.

    A straight edge crosses `over` of the samples. On a path of this length edges and light behind them come to lie beside
    others, whose covariances have either sign and add as the root of their number [photosites].
    """
    return 1.0 / math.sqrt(max(path_px, 1.0)) / over


def read_whole_pixels(projection: Projection, over: int) -> bool:
    """Whether points lie in the middles of samples that hold whole pixels; over: samples per photosite and axis."""
    is_whole = projection.open_side == 1.0 and not projection.is_bilinear
    return is_whole and projection.warp is None and projection.scale > over - 1e-6


def open_parts(scale: float) -> int:
    """Most parts of a photosite along an axis that a layer leaves open, between pixels that hide what is behind."""
    return (math.ceil(scale - 1e-6) + 2) // 2


def cells_ns(layers: int, scale: float, step: int) -> float:
    """Predicted time of a photosite and instant, of all cores over two [ns]: of its cells, and of their sum over its width.

    scale: scene pixels per photosite. step: columns from a photosite of a span to the next, between which cells are left out.
    """
    cells = (layers * scale + 1.0) * layers * step * scale
    return CELL_NS * cells * (2 * layers - 1) + SUM_NS * layers * (math.ceil(scale) + 1)
