"""Contrasts between photosites, measured in strips of a scene."""

from collections.abc import Iterator

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.scene_light import MOST, composite, seen_contrast
from simulator.scene.scene import Layer, Scene

SAME_SCALE = 1e-6  # difference from one scene pixel per photosite at which there is one
_STRIPS = 200  # strips of rows in which a scene's contrasts are measured


def curvatures(
    scene: Scene,
    number: int,
    to_share: np.ndarray,
    defocus: Defocus,
    is_at_rest: bool,
    *,
    along_both: bool = False,
) -> tuple[float, float]:
    """Quantile MOST of the second difference between photosites of a layer, in strips of three photosites' height.

    It counts in the noise of the layer's own light, and, where layers do not move apart, of what is seen before and behind it.
    At its edge a layer ends before black, or before the light behind: a dark one before a bright wall has that edge alone.
    Of all places, and of those inside the scene that the layer covers with what lies around them. Beyond its border the scene
    goes on as it ends there, so that a slope has an edge. Of a scene of so many rows that they do not count, the ends are left
    out. to_share: (bands, channels) shares of the brightest light per unit of the layer's planes. defocus: blur of the scene.
    along_both: whether those along both axes add up, as they do for a blur; else the larger one counts.
    """
    layer, layers = scene.layers[number], scene.layers if is_at_rest else ()
    accuracy, scale, lit_share = defocus.accuracy, defocus.scale, 0.0
    if scale < 1.0 - SAME_SCALE and scene.interpolation != "nearest":
        lit_share = scale * _least_lit(*defocus.ranges_px[number], defocus.copied_px)

    def most_seen(bends: list[np.ndarray], around: np.ndarray) -> np.ndarray:
        """Contrast of bends across and down, of the channel that shows it most: (photosites,)."""
        across, down = bends
        largest = np.maximum(np.abs(across), np.abs(down))
        largest = np.maximum(largest, np.abs(across + down)) if along_both else largest
        lit = around + lit_share * np.maximum(across + down, 0.0)
        return np.asarray(seen_contrast(largest, lit, accuracy).max(axis=1))

    found, inside = [], []
    for part, is_inside in _strips(layer, scale):
        shape = _shape(part, layer)
        light = _means(layer.planes[part] @ to_share, shape)
        around, bends = light[1, 1:-1], _bends(light)
        if len(layers) > 1:
            seen = _means(composite([_seen(one, part, to_share) for one in layers]), shape)
            around = np.maximum(around, seen[1, 1:-1])
        own = most_seen(bends, around)
        if layer.coverage is not None and number + 1 < len(scene.layers):
            behind = _means(composite([_seen(one, part, to_share) for one in scene.layers[number + 1 :]]), shape)[1, 1:-1]
            cover = _means(layer.coverage[part][..., None], shape)
            before = [bend - behind * edge for bend, edge in zip(bends, _bends(cover), strict=True)]
            around = np.maximum(around, light[1, 1:-1] + (1.0 - cover[1, 1:-1]) * behind)
            own = np.maximum(own, most_seen(before, around))
        found.append(own)
        if not is_inside:
            continue
        if layer.coverage is not None:
            filled = layer.coverage[part].reshape(shape).min(axis=(0, 1, 3)) >= 1.0
            own = np.where(filled[:-2] & filled[1:-1] & filled[2:], own, 0.0)
        inside.append(own[1:-1] if len(own) > 2 else own)
    if not found:
        return 0.0, 0.0
    every, texture = (min(scale, 1.0) * float(np.quantile(np.concatenate(one), MOST)) for one in (found, inside))
    return every, texture


def _least_lit(least_px: float, most_px: float, copied_px: float) -> float:
    """Light beside a kink of light that is linear on either side, per change of slope, where a blur circle shows most of it.

    Of the dark pixels in a scene that has fewer than there are photosites. A photosite in the middle of the kink has 1/8 of the
    change, and what a circle brings is 1/8 of its square. Where the kink ends at its border it has none, and the circle brings
    half of that: as much as is seen in four times as much light. least_px, most_px: radii of a layer's circles, of which the
    smallest is seen where the largest is not left out, as they are up to copied_px.
    """
    radius_px = most_px if most_px <= copied_px else max(least_px, 0.0)
    return min(1.0 / 8.0, 0.25 * radius_px**2) if radius_px > 0.0 else 1.0 / 8.0


def _means(values: np.ndarray, shape: tuple[int, int, int, int]) -> np.ndarray:
    """Means of values of a strip's pixels over photosites, of this `_shape`: (3, photosites, ...)."""
    return np.asarray(values.reshape(*shape, -1).mean(axis=(1, 3)))


def _seen(layer: Layer, part: tuple[np.ndarray, ...], to_share: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Light and coverage of a layer in a strip."""
    return layer.planes[part] @ to_share, None if layer.coverage is None else layer.coverage[part]


def _bends(values: np.ndarray) -> list[np.ndarray]:
    """Second differences of means (3, photosites, ...) across and down, of all in the middle but the ends."""
    return [np.diff(values, 2, axis=1)[1], np.diff(values, 2, axis=0)[0, 1:-1]]


def border_contrast(
    layer: Layer, to_share: np.ndarray, accuracy: Accuracy, scale: float, borders_px: np.ndarray, beside_px: float
) -> float:
    """Quantile MOST of the steps of light over the borders of a photosite, those along both axes together.

    A step is the difference of the means over the width beside_px on either side of a border [photosites]. borders_px:
    distances of the borders on one side from the middle of the photosite, at most 1, steps over which are averaged; those on
    the other side mirror them. Whole photosites beside a border half of one away have the sum of the second differences along
    both axes. What lies farther than 1.5 photosites is not looked at. The arguments are else those of `curvatures`, of a scene
    finer than the photosites.
    """
    found = [np.zeros(1)]
    for part, _ in _strips(layer, scale):
        shape = _shape(part, layer)
        side, light = shape[1], layer.planes[part].reshape(*shape, -1)
        lines = light[1].mean(axis=0).reshape(shape[2] * side, -1), light.mean(axis=3).reshape(3 * side, shape[2], -1)[:, 1:-1]
        across, down = (_steps(line, side, borders_px, beside_px) @ to_share for line in lines)
        own = light[1, :, 1:-1].mean(axis=(0, 2)) @ to_share
        found.append(seen_contrast(across + down[0], own, accuracy).max(axis=1))
    return float(np.quantile(np.concatenate(found), MOST))


def _steps(line: np.ndarray, side: int, borders_px: np.ndarray, beside_px: float) -> np.ndarray:
    """Steps over the borders of all photosites but the first and last along the first axis, those towards them.

    line: (photosites * side, ...) light.
    """
    sums = np.cumsum(np.concatenate([np.zeros_like(line[:1]), line], dtype=np.float64), axis=0)
    middles = side * (np.arange(1, len(line) // side - 1) + 0.5)

    def sum_to(away_px: float) -> np.ndarray:
        """Sum of the light up to a distance from the middles, between pixels in proportion."""
        places = middles + side * away_px
        whole = np.minimum((places + 1e-6).astype(int), len(line) - 1)
        past = (places - whole).reshape(-1, *[1] * (line.ndim - 1))
        return np.asarray(sums[whole] + past * line[whole])

    found = np.zeros((len(middles), *line.shape[1:]))
    for way in (-1.0, 1.0):
        for border_px in way * borders_px:
            reach_px = min(beside_px, 1.5 - abs(border_px))
            step = sum_to(border_px + reach_px) - 2.0 * sum_to(border_px) + sum_to(border_px - reach_px)
            found += way / reach_px * step
    return found / (len(borders_px) * side)


def _strips(layer: Layer, scale: float) -> Iterator[tuple[tuple[np.ndarray, ...], bool]]:
    """Places of a layer's pixels in strips of three photosites' height, one more at each end, and whether all are inside.

    Of a scene that is lower than a strip all count as inside, since it has no others.
    """
    side, (rows, columns, _) = max(1, round(scale)), layer.planes.shape
    if min(rows, columns) < side:
        return
    ends = side if rows * (1.0 - MOST) <= 2.0 * side else 0
    across_px = np.clip(np.arange(-side, columns // side * side + side), 0, columns - 1)
    for top in np.unique(np.linspace(-ends, rows - 3 * side + ends, _STRIPS).astype(int)):
        yield (
            np.ix_(np.clip(np.arange(top, top + 3 * side), 0, rows - 1), across_px),
            bool(0 <= top <= rows - 3 * side or rows < 3 * side),
        )


def _shape(part: tuple[np.ndarray, ...], layer: Layer) -> tuple[int, int, int, int]:
    """Photosites and their pixels, down and across, of a strip."""
    side = part[0].size // 3
    return 3, side, part[1].size // side, side
