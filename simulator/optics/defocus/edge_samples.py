"""What is left out where means over photosites are composited instead of what photosites see: measured at some photosites.

Along its way an edge of a layer comes to lie in a photosite beside light of all kinds, and leaves covariances of either sign.
How much is left of them depends on the scene and on the way far more than a bound can tell, so that some photosites are looked
at. Where an edge lies in one, borders of all layers' pixels cut it into cells of even light.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.geometry.projection import Projection
from simulator.scene.scene import Layer

PHOTOSITES = 512  # that are looked at
MARGIN = 1.25  # of the largest of PHOTOSITES over what one in a thousand leaves
RARE = 0.001  # share of photosites that may be worse
CELLS_TOGETHER = 2**18  # that are looked at together
SAME = 1e-6  # of a pixel


@dataclass(frozen=True)
class EdgeSamples:
    """Photosites, or samples of them, that edges of layers may cross.

    row, column: (photosites,) on the sensor, in samples. line: (photosites,) their numbers in `ways` (lines, instants, layers,
    2), which layers are displaced x, y [photosites]. shares: (lines, instants) of a line's light. weights: (photosites, bands)
    of scene planes in electron radiance, of each one's colour. crossed: share of all photosites that these stand for.
    part: of what each lacks that its photosite does: an edge crosses some of the samples of a photosite.
    """

    row: np.ndarray
    column: np.ndarray
    line: np.ndarray
    ways: np.ndarray
    shares: np.ndarray
    weights: np.ndarray
    crossed: float
    part: float = 1.0


def choose_samples(
    crossed: np.ndarray, wide: int, columns: int, rows: np.ndarray, ways: np.ndarray, shares: np.ndarray, weights: np.ndarray
) -> EdgeSamples:
    """Return photosites at random places of crossed spans, in colours that take turns.

    crossed: (rows, spans) bool, of spans `wide` samples across of so many columns. rows: their numbers. weights: (bands,
    channels). Other arguments are as of `EdgeSamples`, of one line or of one for each of the rows.
    """
    rng = np.random.default_rng(2)
    row, span = np.nonzero(crossed)
    chosen = rng.integers(len(row), size=PHOTOSITES) if len(row) else np.zeros(0, np.intp)
    column = np.minimum(wide * span[chosen] + rng.integers(wide, size=len(chosen)), columns - 1)
    line = row[chosen] if len(ways) > 1 else np.zeros(len(chosen), np.intp)
    colour = np.arange(len(chosen)) % weights.shape[1]
    return EdgeSamples(rows[row[chosen]], column, line, ways, shares, weights.T[colour], float(crossed.mean()))


def lacked_sigma(layers: Sequence[Layer], samples: EdgeSamples, projection: Projection, over: int, accuracy: Accuracy) -> float:
    """Return what all but RARE photosites lack at most [standard deviations of their noise].

    layers: the nearest first, the last of which covers all. over: samples per photosite and axis.
    """
    corners, side = corners_of(samples, projection, over)
    shares = np.broadcast_to(samples.shares, (len(samples.ways), samples.shares.shape[1]))
    per_e, lacked = accuracy.electrons_per_radiance, np.zeros(len(corners))
    is_cut, ways_px = are_cut(layers, samples, projection, over), projection.scale * samples.ways
    for photosite in np.flatnonzero(is_cut.any(axis=1)):  # all others lack nothing
        line, weights = samples.line[photosite], samples.weights[photosite]
        light, covariance = _seen(layers, corners[photosite] + ways_px[line], is_cut[photosite], side, weights)
        light, left = shares[line] @ light, shares[line] @ covariance
        lacked[photosite] = per_e * abs(left) / np.sqrt(max(per_e * light + accuracy.read_noise_e**2, 1.0))
    rare = RARE / samples.crossed if samples.crossed else 1.0
    return MARGIN * samples.part * float(np.quantile(lacked, 1.0 - rare, method="higher")) if rare < 1.0 else 0.0


def corners_of(samples: EdgeSamples, projection: Projection, over: int) -> tuple[np.ndarray, float]:
    """Upper left corners of samples at rest, (photosites, 2) x, y, and their side [px]."""
    scale = projection.scale / over
    is_square = projection.has_squares if over == 1 else projection.nearest or scale > 1.0 + SAME
    side = scale * (projection.open_side if over == 1 else 1.0) if is_square else 1.0
    middles = scale * (np.stack([samples.column, samples.row], axis=-1) + 0.5)
    return np.array([projection.offset_x, projection.offset_y]) + middles - 0.5 * side, side


def are_cut(layers: Sequence[Layer], samples: EdgeSamples, projection: Projection, over: int) -> np.ndarray:
    """Whether the edge of a layer may lie in each of the samples, as their lines displace them, (photosites, instants)."""
    corners, side = corners_of(samples, projection, over)
    ways_px, lines = projection.scale * samples.ways, samples.line
    count, instants = math.ceil(side - SAME) + 1, ways_px.shape[1]
    pixels = np.stack(np.meshgrid(*[np.arange(count)] * 2), axis=-1).reshape(-1, 2)
    found = np.zeros((len(corners), instants), bool)
    together = max(CELLS_TOGETHER // (instants * len(pixels)), 1)
    for part in (slice(first, first + together) for first in range(0, len(corners), together)):
        for number, layer in enumerate(layers[:-1]):
            first = np.floor(corners[part, None] + ways_px[lines[part], :, number])  # (photosites, instants, 2)
            covered = _coverage(layer, *_pixels(layer, first[..., None, :] + pixels))
            found[part] |= (covered != covered[..., :1]).any(axis=-1)
    return found


def _seen(
    layers: Sequence[Layer], places: np.ndarray, is_cut: np.ndarray, side: float, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Light of a photosite whose corner lies at `places`, and what composites of means lack of it, (instants,) each.

    Where no edge lies in it, which lacks nothing, its light is that of its middle. is_cut: (instants,) of `are_cut`.
    """
    lacked, pixels = np.zeros(len(places)), math.ceil(side - SAME) + 1
    light = _composite(_read(layers, places[:, None] + 0.5 * side, weights))[:, 0]
    cut = np.flatnonzero(is_cut)
    together = max(CELLS_TOGETHER // (len(layers) * pixels + 1) ** 2, 1)
    for part in (cut[first : first + together] for first in range(0, len(cut), together)):
        begins, widths = _cells(places[part], side)
        cells = begins + 0.5 * widths  # (instants, cells, 2)
        x, y = (cells[..., axis] for axis in (0, 1))
        size = x.shape[1]
        inside = np.stack([np.tile(x, (1, size)), np.repeat(y, size, axis=1)], axis=-1)
        areas = (np.repeat(widths[..., 1], size, axis=1) * np.tile(widths[..., 0], (1, size))) / side**2
        read = _read(layers, places[part][:, None] + inside[:, :, None], weights)
        means = [tuple((areas * one).sum(axis=1) for one in layer) for layer in read]
        light[part] = (areas * _composite(read)).sum(axis=1)
        lacked[part] = light[part] - _composite(means)
    return light, lacked


def _cells(places: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Where cells between pixels' borders begin, from the corners `places`, and their widths, (instants, cells, 2)."""
    borders = np.ceil(places) - places  # of the first pixel of each layer
    borders = np.concatenate([borders + pixel for pixel in range(math.ceil(side - SAME))], axis=1)
    ends = np.zeros_like(borders[:, :1])
    borders = np.concatenate([ends, np.sort(np.minimum(borders, side), axis=1), ends + side], axis=1)
    return borders[:, :-1], np.diff(borders, axis=1)


def _read(layers: Sequence[Layer], places: np.ndarray, weights: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Light and coverage of each layer at places (instants, points, layers, 2) [px]."""
    found = []
    for number, layer in enumerate(layers):
        at = _pixels(layer, places[:, :, number])
        found.append((layer.planes[at] @ weights, _coverage(layer, *at)))
    return found


def _pixels(layer: Layer, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of a layer's pixels at places x, y (..., 2); its edge continues."""
    height, width = layer.planes.shape[:2]
    column, row = np.moveaxis(np.floor(places), -1, 0)
    return np.clip(row, 0, height - 1).astype(np.intp), np.clip(column, 0, width - 1).astype(np.intp)


def _coverage(layer: Layer, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Coverage of a layer's pixels."""
    return np.ones(row.shape) if layer.coverage is None else layer.coverage[row, column].astype(np.float64)


def _composite(layers: Sequence[tuple[np.ndarray, ...]]) -> np.ndarray:
    """Light of layers, given as light and coverage, front to back."""
    seen, through = np.zeros(1), np.ones(1)
    for light, coverage in layers:
        seen, through = seen + through * light, through * (1.0 - coverage)
    return seen
