"""Contrasts of a scene on which the errors of its blur depend."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.device.threads import in_threads
from simulator.optics.defocus.accuracy import grid_error, twice_blurred_share
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.around_contrast import AROUND_PX, around_contrast
from simulator.optics.defocus.bent_surfaces import surface_bend
from simulator.optics.defocus.crossing_contrast import border_crossings, crossings_in_focus
from simulator.optics.defocus.defocus import STEEPEST_PX, Defocus
from simulator.optics.defocus.edge_contrast import WIDEST_PX, DepthEdgeContrast, depth_edge_contrast
from simulator.optics.defocus.edge_laws import LITS
from simulator.optics.defocus.layer_contrast import Surface, layer_contrast
from simulator.optics.defocus.path_contrast import parts_around, parts_of
from simulator.optics.defocus.path_weights import lattices, pixels_of
from simulator.optics.defocus.scene_light import (
    LAMP,
    MOST,
    composite,
    flattened_error,
    layer_at,
    scene_detail,
    seen_contrast,
    shifted,
)
from simulator.optics.defocus.strip_contrast import curvatures
from simulator.optics.geometry.scene_part import ScenePart
from simulator.scene.occluded_background import EDGE_PX
from simulator.scene.scene import Layer, Scene
from simulator.scene.window_filters import window_mean

MOST_LAMPS = 16  # brightest ones of a layer around which its light is looked at
FEW_LAMPS, FEW = 4, 4000  # pixels that may be lamps in scenes of so few that these count as the brightest light
MOST_MIXED = 250_000  # places of a composite whose range is measured
ASIDE = (
    ((0.0, 0.0, 1.0),),
    ((0.5, 0.0, 1.0),),
    ((0.0, 0.5, 1.0),),
    ((0.5, 0.5, 1.0),),
)  # parts of pixels between which light is read
WIDEST_END_PX = 4.0  # larger circles count as these [photosites]
WIDENED_PX = 1.05, 2.1, 3.1  # radii at which weights of whole samples are wider than their circle by most
INSIDE_PX = 0.5  # largest radius of a circle inside a photosite
CELLS = 6  # of a sample and axis, over which its light is known
STEEP_PX = 0.5, 1.5  # radii at which circles reach the next pixels, where even squares leave most of light between them
PERIOD_PX = 0.25  # from one of the radii to the next at which a period of what squares leave is looked at
OF_BEND = 0.4  # edge that is wrong by as much as a bend, per square of pixels per photosite
MOST_EDGES = 250_000  # pixels between which edges are measured


@dataclass(frozen=True)
class SceneContrast:
    """Contrasts as shares of the brightest light; the defaults are the largest that the laws of the blur assume.

    Where the light is weaker, and with it the noise, a difference counts as much more as it is seen more clearly.

    curvature: second difference of the light between photosites. texture: the same, without the borders of layers and scene.
    lamp: light of the brightest blur spot of a single scene pixel that is LAMP times as bright as the brightest light.
    around_lamps: least light around such a spot, at most 1: mean within its circle; 1: of bilinear light.
    beside: deviation of the light beside depth edges from its mean around them, that of lamps left out; 0.5 where it varies by
        its whole range. behind: the same, where the scene does not hold what is hidden; 0: it does. hidden: its mean over the
        part of the aperture that sees it at rest (`edge_contrast`).
    has_steps: whether a surface has steps in depth, so that it occludes parts of itself.
    mixed: `layer_contrast.LayerContrast` of several layers over points, lamps left out; 0: there is one layer, or even
        light behind it: the first one's own light is a mean, whatever is behind. within: the same over samples.
        along: of edges as long as the circles, over the smaller radius (`LayerContrast.over_edges`).
    lamps_mixed, lamps_within: the same with lamps, in the noise of the light without them, where pixels are wider than
        photosites: edges, which end over a pixel, leave light of lamps that they hide; 0: there are none.
    lamp_px: least blur radius of pixels that are lamps; inf: none is [photosites].
    bent: `bent_surfaces.surface_bend` of surfaces without steps.
    around: range of the light within a blur circle of surfaces whose radius varies, that of lamps left out, for circles of each
        size (`around_contrast.AROUND_PX`); 0: none varies.
    edges: difference of neighbouring pixels, that of lamps left out, as photosites see it that get `edge_laws.LITS` of it: of
        what moves (`scene_edges`).
    ends: second difference of the light behind the smallest circle, mean of both axes, in the noise of that light, which is
        least where a penumbra ends; of pixels as wide as photosites and wider, twelve times what even squares, or weights of a
        path, leave of light between pixels; 0: pixels are even squares (`Accuracy.detail`), or its own curvature says more.
        ends_aside: the same where photosites read the light anywhere between the pixels; 0: not of one pixel per photosite.
    bends: the same of means over photosites of one upright surface of even squares; None: not measured.
    few: light of the brightest pixel of a scene of so few that it counts as the brightest light; 0: others are as bright.
    crossed: error of the largest circle that is left out behind a point spread function, of `psf.left_out_blur`; None: it is
        that of the curvature.
    crossings: light that crosses the borders of photosites of a fine scene behind a circle that is left out, per radius in
        photosites, that of lamps left out, where all borders count; 0: not measured, or one pixel per photosite and fewer.
    in_focus: light over a border that images of even squares have too much on slopes near the focus (`radii_in_focus`).
    shifted: light that a pupil clipped by rims moves aside where its circle is left out, per radius in photosites: its middle
        lies beside the axis; 0: no rim clips.
    flattened: `scene_light.flattened_error` of layers whose blur is left out; 0: there is one, or no light between pixels.
    """

    curvature: float = 1.0
    lamp: float = 0.0
    beside: float = 0.5
    behind: float = 0.0
    has_steps: bool = False
    texture: float = 1.0
    mixed: float = 1.0
    around: tuple[float, ...] = (1.0,) * len(AROUND_PX)
    edges: tuple[float, ...] = (1.0,) * len(LITS)
    ends: float = 0.0
    ends_aside: float = 0.0
    bends: float | None = None
    flattened: float = 0.0
    around_lamps: float = 1.0
    within: float = 1.0
    along: float = 0.0
    few: float = 0.0
    lamps_mixed: float = 0.0
    lamps_within: float = 0.0
    bent: float = 0.0
    lamp_px: float = 0.0
    hidden: float = 0.0
    crossed: float | None = None
    crossings: float = 0.0
    in_focus: float = 0.0
    shifted: float = 0.0


def scene_contrast(
    scene: Scene, weights: np.ndarray, per_share: float, defocus: Defocus, seen: ScenePart, *, is_at_rest: bool = False
) -> SceneContrast:
    """Measure the contrasts of a scene as it is loaded, without a background that is only assumed.

    weights: (bands, channels) of scene planes in electron radiance. per_share: shares of the brightest light per electron
    radiance. defocus: blur of the scene. seen: the part that photosites see. is_at_rest: whether no layer moves.
    """
    to_share = per_share * weights
    layers = list(zip(scene.layers, defocus.radii_px, strict=False))
    found = [curvatures(scene, number, to_share, defocus, is_at_rest) for number in range(len(layers))]
    curvature, texture = np.max(found, axis=0).tolist()
    spots = [_brightest_spot(scene, number, to_share, defocus) for number in range(len(layers))]
    lamp, around_lamps = max(spot for spot, _ in spots), min(dark for _, dark in spots)
    has_steps = any(_has_steps(radius, defocus.scale) for _, radius in layers)
    ranges = _ranges(scene, to_share, defocus) if scene.behind else {}
    ends, aside = (0.0, 0.0) if defocus.accuracy.detail else _penumbra_ends(scene, to_share, defocus, curvature)
    is_alone = defocus.accuracy.detail > 0.0 and not scene.behind and not defocus.maps
    steps = depth_edge_contrast(scene, to_share, defocus) if has_steps else DepthEdgeContrast()
    return SceneContrast(
        curvature,
        lamp,
        steps.beside,
        steps.behind,
        has_steps,
        texture,
        mixed=ranges.get("mixed", 0.0),
        around=_around(scene, to_share, defocus) if defocus.maps else (0.0,) * len(AROUND_PX),
        ends=ends,
        ends_aside=aside,
        bends=_bends_of_squares(scene, to_share, defocus) if is_alone else None,
        around_lamps=around_lamps,
        within=ranges.get("within", 0.0),
        along=ranges.get("along", 0.0),
        lamps_mixed=ranges.get("lamps_mixed", 0.0),
        lamps_within=ranges.get("lamps_within", 0.0),
        lamp_px=min(_least_lamp_px(*pair, to_share) for pair in layers) if defocus.accuracy.has_lamps else math.inf,
        hidden=steps.hidden,
        in_focus=crossings_in_focus(scene, to_share, defocus) if defocus.accuracy.detail else 0.0,
        bent=surface_bend(scene, to_share, defocus, seen) if defocus.maps and not has_steps else 0.0,
        shifted=_shifted(scene, weights, per_share, defocus),
    )


def _shifted(scene: Scene, weights: np.ndarray, per_share: float, defocus: Defocus) -> float:
    """Return `SceneContrast.shifted`: at the corner of the sensor, of differences between pixels."""
    if defocus.eyes is None:
        return 0.0
    detail = scene_detail(scene, weights, per_share * defocus.accuracy.electrons, defocus.accuracy)
    return math.sqrt(2.0) * defocus.eyes.farthest_shift() * detail * min(defocus.scale, 1.0)  # along both axes


def _brightest_spot(scene: Scene, number: int, to_share: np.ndarray, defocus: Defocus) -> tuple[float, float]:
    """Light of a pixel above the brightest light, on the area of its blur circle: the largest of a layer; and what is around.

    Up to the blur radius `Accuracy.sharp_px` a pixel is copied. number: of the layer.
    """
    layer, radius_px, scale, sharp_px = scene.layers[number], defocus.radii_px[number], defocus.scale, defocus.accuracy.sharp_px
    is_square = scale >= 1.0 - 1e-6  # light between coarser pixels is bilinear, and spots end softly (`SceneContrast.ends`)
    most = _brightest_beside_lamps(layer, to_share) if is_square else 1.0
    bright = (layer.planes > most / np.maximum(to_share.sum(axis=1) * layer.planes.shape[2], 1e-30)).any(axis=2)
    if isinstance(radius_px, np.ndarray):
        bright &= np.abs(radius_px) > sharp_px
    rows, columns = np.nonzero(bright)
    if not len(rows) or (not isinstance(radius_px, np.ndarray) and abs(radius_px) <= sharp_px):
        return 0.0, 1.0
    light = (layer.planes[rows, columns] @ to_share).max(axis=1)
    light = np.where(light > LAMP * most, light, 0.0)
    own = np.abs(radius_px[rows, columns] if isinstance(radius_px, np.ndarray) else np.full(len(rows), radius_px))
    spot_px = math.pi * np.maximum(own, 0.5) ** 2
    narrow = min(scale, 1.0 / scale) ** 2  # a pixel wider than a photosite has soft edges, one that is narrower little light
    spots = narrow * np.maximum(light - most, 0.0) / spot_px
    if not is_square:
        return float(spots.max()), 1.0
    brightest = np.argsort(-spots, kind="stable")[:MOST_LAMPS]
    brightest = brightest[spots[brightest] > 0.1 * spots.max()]
    places = zip(rows[brightest].tolist(), columns[brightest].tolist(), own[brightest].tolist(), strict=True)
    return float(spots.max()), min((_least_around(scene, to_share, scale, *place) for place in places), default=1.0)


def _least_lamp_px(layer: Layer, radius_px: float | np.ndarray, to_share: np.ndarray) -> float:
    """Least blur radius of a layer's pixels that are lamps; inf: none is [photosites]."""
    is_lamp = (layer.planes > LAMP / np.maximum(to_share.sum(axis=1) * layer.planes.shape[2], 1e-30)).any(axis=2)
    is_lamp[is_lamp] = (layer.planes[is_lamp] @ to_share).max(axis=1) > LAMP
    return float(np.abs(np.broadcast_to(radius_px, is_lamp.shape)[is_lamp]).min(initial=math.inf))


def _brightest_beside_lamps(layer: Layer, to_share: np.ndarray) -> float:
    """Brightest light of a layer, at most 1, that of FEW_LAMPS left out where these are in its quantile."""
    if layer.planes[..., 0].size >= FEW:
        return 1.0
    light = np.sort((layer.planes @ to_share).max(axis=2), axis=None)
    return min(float(light[-FEW_LAMPS - 1 :][0]), 1.0)


def _brightest_of_few(layer: Layer, to_share: np.ndarray) -> float:
    """Return `SceneContrast.few` of a layer."""
    most, pixels = _brightest_beside_lamps(layer, to_share), layer.planes[..., 0].size
    brightest = float((layer.planes @ to_share).max()) if pixels < FEW else 0.0
    return brightest if brightest > LAMP * most else 0.0


def _least_around(scene: Scene, to_share: np.ndarray, scale: float, row: int, column: int, radius_px: float) -> float:
    """Least mean within a blur circle that touches that of a pixel, lamps left out, of layers at rest; at most 1."""
    reach, side = (math.ceil(factor * max(radius_px, 0.5) * scale) for factor in (2.0, math.sqrt(math.pi)))
    size = scene.planes.shape[:2]
    down, right = (
        np.clip(np.arange(middle - reach, middle + reach + 1), 0, length - 1)
        for middle, length in zip((row, column), size, strict=True)
    )
    light = composite([layer_at(layer, np.ix_(down, right), to_share) for layer in scene.layers])
    is_lamp = light >= LAMP
    if is_lamp.all():
        return 1.0
    light[is_lamp] = light[~is_lamp].mean()
    least = window_mean(light, side, "nearest").min()
    return min(max(float(least), 0.0), 1.0)


def _has_steps(radius_px: float | np.ndarray, scale: float) -> bool:
    """Whether the radius changes by more than a continuous surface's between neighbouring photosites."""
    if not isinstance(radius_px, np.ndarray):
        return False
    least = min(EDGE_PX, STEEPEST_PX / scale)
    return any(bool((np.abs(np.diff(radius_px, axis=axis)) > least).any()) for axis in (0, 1))


def sharp_contrast(
    scene: Scene, weights: np.ndarray, per_share: float, defocus: Defocus, *, is_at_rest: bool = False, is_bilinear: bool
) -> SceneContrast:
    """Measure the contrast on which the error of leaving out a blur depends.

    is_bilinear: whether photosites are means of light between pixels. Other arguments are those of `scene_contrast`.
    """
    own = per_share * weights, defocus, is_at_rest
    every = [curvatures(scene, number, *own, along_both=True)[0] for number in range(len(scene.layers))]
    flattened, accuracy = 0.0, defocus.accuracy
    if is_bilinear:
        flattened = flattened_error(scene, weights, per_share * accuracy.electrons, accuracy, MOST)
    few = max(_brightest_of_few(layer, per_share * weights) for layer in scene.layers)
    crossings = border_crossings(scene, per_share * weights, defocus) if accuracy.detail else 0.0
    shifted = _shifted(scene, weights, per_share, defocus)
    return SceneContrast(curvature=max(every), flattened=flattened, few=few, crossings=crossings, shifted=shifted)


def _ranges(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> dict[str, float]:
    """Return the fields of `SceneContrast` that several layers have: quantiles MOST, by the noise of the light's mean.

    The mean is that within the smallest circle. Layers are composited at rest.
    """
    layers, step = _thinned(scene, to_share)
    scale, light = defocus.scale / step, composite(layers)
    smallest_px = min(least for least, _ in defocus.ranges_px)
    mean = window_mean(light, max(min(2 * math.ceil(smallest_px * scale) + 1, WIDEST_PX), round(scale)))

    def most_seen(contrast: np.ndarray) -> float:
        return float(np.quantile(seen_contrast(contrast, mean, defocus.accuracy), MOST))

    behind = [composite(layers[number:]) for number in range(len(layers))]
    own = layer_contrast(layers, behind, defocus, scale)
    found = {name: most_seen(plane) for name, plane in (("mixed", own.over_points), ("within", own.over_samples))}
    found["along"] = most_seen(own.over_edges)
    lit = [(layer.planes[::step, ::step] @ to_share, cover) for layer, (_, cover) in zip(scene.layers, layers, strict=True)]
    if defocus.scale < 1.0 - 1e-6 and max(float(own.max()) for own, _ in lit[1:]) > LAMP:
        behind = [composite(lit[number:]) for number in range(len(lit))]
        lamps = layer_contrast(lit, behind, defocus, scale)
        found |= {"lamps_mixed": most_seen(lamps.over_points), "lamps_within": most_seen(lamps.over_samples)}
    return found


def _around(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> tuple[float, ...]:
    """Return `SceneContrast.around`."""
    layers, step = _thinned(scene, to_share)
    return around_contrast(layers, defocus, defocus.scale / step, step)


def _thinned(scene: Scene, to_share: np.ndarray) -> tuple[list[Surface], int]:
    """Light, that of lamps left out, and coverage of each layer at every so many rows and columns, MOST_MIXED at most."""
    step = math.ceil(math.sqrt(scene.planes[..., 0].size / MOST_MIXED))
    every = slice(None, None, step), slice(None, None, step)
    return [layer_at(layer, every, to_share) for layer in scene.layers], step


def _penumbra_ends(scene: Scene, to_share: np.ndarray, defocus: Defocus, curvature: float) -> tuple[float, float]:
    """Return `SceneContrast.ends` and `ends_aside`, of layers at rest; 0 where the scene's own curvature is no more.

    curvature: of the scene. Of a large scene parts on a grid are looked at. Of a fine scene second differences count, too: what
    whole photosites leave at an edge along their border falls more slowly than by the square of their samples.
    """
    ranges = [pair for pair in defocus.ranges_px if defocus.maps or pair[1] > defocus.copied_px]  # what is blurred
    radius_px = min((least for least, _ in ranges), default=0.0)
    if radius_px <= defocus.copied_px or curvature == 0.0:
        return 0.0, 0.0
    if abs(defocus.scale - 1.0) < 1e-6:
        radii_px = steep_radii(radius_px, defocus.largest_px)
        if not defocus.maps:  # those that there are, and where others reach the next pixels
            radii_px = [one for one in radii_px if one in STEEP_PX] + [most for _, most in ranges]
        return _pixel_ends(scene, to_share, defocus, sorted({min(one, WIDEST_END_PX) for one in radii_px}))
    if curvature * twice_blurred_share(radius_px, defocus.scale) <= 12.0 * grid_error(radius_px, 1, defocus.scale):
        return 0.0, 0.0
    bends = _bends_of_parts(scene, to_share, defocus, radius_px) if defocus.scale > 1.0 else 0.0
    return max(bends, _ends_between_pixels(scene, to_share, defocus, radius_px)), 0.0


def steep_radii(least_px: float, largest_px: float) -> list[float]:
    """Radii among these [photosites] at which even squares leave most of light between pixels.

    What they leave comes and goes as the rim crosses pixels, and fades with larger circles: all of one pixel's width count, and
    those that reach the next pixels.
    """
    within = np.append(least_px + np.arange(PERIOD_PX, 1.0 + 2.0 * PERIOD_PX, PERIOD_PX), STEEP_PX).tolist()
    last_px = min(largest_px, max(least_px + 1.0 + PERIOD_PX, STEEP_PX[-1]))
    return [least_px, *sorted({one for one in (*within, last_px) if least_px < one <= last_px})]


def _bends_of_squares(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> float:
    """Return `SceneContrast.bends`. Slow waves keep theirs behind circles that leave little of edges."""
    return _bends_of_parts(scene, to_share, defocus, defocus.largest_px, max(int(defocus.scale), 1))


def _bends_of_parts(scene: Scene, to_share: np.ndarray, defocus: Defocus, radius_px: float, side: int = 1) -> float:
    """Quantile MOST of `_bends_behind` a circle, of parts of a scene, of means over squares of so many pixels."""
    behind, places = disk_weights(min(radius_px, WIDEST_END_PX)), parts_of(scene, defocus.scale)
    lights = [composite([layer_at(layer, place, to_share) for layer in scene.layers]) for place in places]
    lights = [window_mean(light, side, "nearest") for light in lights]
    return float(np.quantile(np.concatenate([_bends_behind(light, behind, defocus).ravel() for light in lights]), MOST))


def _ends_between_pixels(scene: Scene, to_share: np.ndarray, defocus: Defocus, radius_px: float) -> float:
    """Return `SceneContrast.ends` of pixels unlike the photosites, from the smallest radius on; of a large scene, of parts.

    Means over photosites, weighted by the areas of a circle in photosites, have more variance than a photosite behind a circle:
    a twelfth of its square where the circle is wide, and up to 1.7 times that, or a fourth, as the rim lies among photosites.
    Of a circle inside a photosite nothing is left, so that of these the largest counts.
    What cells leave themselves in the light that these are held against is as much, of their own size.
    """
    inside_px = min(INSIDE_PX, defocus.largest_px)
    radii_px = [radius_px, *(one for one in (inside_px, *WIDENED_PX) if radius_px < one <= defocus.largest_px)]
    lights = [
        composite([layer_at(layer, place, to_share) for layer in scene.layers]) for place in parts_of(scene, defocus.scale)
    ]
    cases = [(light, min(one, WIDEST_END_PX)) for one in radii_px for light in lights]
    left = in_threads(lambda case: _left_of_circle(*case, defocus).ravel(), cases)
    of_radii = [np.concatenate(left[first : first + len(lights)]) for first in range(0, len(left), len(lights))]
    return 12.0 * (1.0 + CELLS**-2.0) * max(float(np.quantile(own, MOST)) for own in of_radii)


def _left_of_circle(light: np.ndarray, radius_px: float, defocus: Defocus) -> np.ndarray:
    """What weights of a circle leave of light whose means over photosites they are given, in the noise of that light.

    light: as of `_bends_behind`. Returns (channels, rows, columns) of photosites.
    """
    beside, found = math.ceil(radius_px) + 1, []
    for axis, length in enumerate(light.shape[:2]):
        cells = np.arange(-beside * CELLS, (round(length / defocus.scale) + beside) * CELLS) + 0.5
        places = cells / CELLS * defocus.scale - 0.5
        light = between(light, places if defocus.scale < 1.0 else np.rint(places), axis)  # even squares
    inner = slice(beside, -beside)

    def means(cells: np.ndarray) -> np.ndarray:
        return cells.reshape(len(cells) // CELLS, CELLS, -1, CELLS).mean(axis=(1, 3))

    for channel in range(light.shape[2]):
        own = light[..., channel].astype(np.float64)
        seen = means(_behind_disk(own, CELLS * radius_px))[inner, inner]
        left = _behind_disk(means(own), radius_px)[inner, inner] - seen
        found.append(seen_contrast(np.abs(left), np.maximum(seen, 0.0), defocus.accuracy))
    return np.stack(found)


def _behind_disk(values: np.ndarray, radius_px: float) -> np.ndarray:
    """Sums of values (rows, columns) around each with `disk_weights`; beyond an end those at the other."""
    return np.fft.irfft2(np.fft.rfft2(values) * _transformed_disk(radius_px, values.shape), values.shape)


@lru_cache(maxsize=8)  # the parts of a scene have one size
def _transformed_disk(radius_px: float, shape: tuple[int, ...]) -> np.ndarray:
    """Transform of `disk_weights` whose middle is the first element of so many rows and columns."""
    weights = disk_weights(radius_px)
    placed = np.zeros(shape)
    placed[: len(weights), : len(weights)] = weights
    return np.fft.rfft2(np.roll(placed, (-(len(weights) // 2),) * 2, (0, 1)))


def _pixel_ends(scene: Scene, to_share: np.ndarray, defocus: Defocus, radii_px: list[float]) -> tuple[float, float]:
    """Return `_penumbra_ends` of one pixel per photosite: of photosites that read pixels, and of those that read aside of them.

    What is read of two pixels at the part f between them has f (1 - f) of variance, which the light has not: even squares lack
    a twelfth of a pixel's square at f = 0, and have a sixth too much at 1/2. What both axes leave is largest at one of these.
    """
    pairs = [lattices(disk_weights, radius_px, ASIDE) for radius_px in radii_px]
    every = [pair for own in pairs for pair in own]
    parts = parts_around(scene, to_share, 1.0, defocus.accuracy, every)
    left = [
        [12.0 * parts.left(pixels_of(disk_weights(radius_px), read) - exact, parts.filtered(exact)) for read, exact in own]
        for radius_px, own in zip(radii_px, pairs, strict=True)
    ]
    return max(own[0] for own in left), max(map(max, left))


def _bends_behind(light: np.ndarray, weights: np.ndarray, defocus: Defocus) -> np.ndarray:
    """Second difference between photosites, mean of both axes, behind weights of a circle, in the noise of that light.

    light: (rows, columns, channels) of scene pixels, between which it is linear, and which go on as they end.
    """
    from scipy.ndimage import convolve

    beside = len(weights) // 2 + 1
    for axis, length in enumerate(light.shape[:2]):
        light = between(light, (np.arange(-beside, round(length / defocus.scale) + beside) + 0.5) * defocus.scale - 0.5, axis)
    found = []
    for channel in range(light.shape[2]):
        own = convolve(light[..., channel], weights, mode="nearest")
        across, down = np.abs(np.diff(own, 2, axis=1))[1:-1], np.abs(np.diff(own, 2, axis=0))[:, 1:-1]
        found.append(seen_contrast(0.5 * (across + down), own[1:-1, 1:-1], defocus.accuracy))
    return np.stack(found)


def between(values: np.ndarray, places: np.ndarray, axis: int) -> np.ndarray:
    """Values at places along an axis, linear between theirs; beyond its ends those at the ends."""
    last = values.shape[axis] - 1
    places = np.clip(places, 0.0, last)
    before = places.astype(int)
    past = np.expand_dims(places - before, tuple(range(1, values.ndim - axis))).astype(values.dtype)
    low, high = (np.take(values, np.minimum(one, last), axis=axis) for one in (before, before + 1))
    return np.asarray(low + past * (high - low))


def scene_edges(scene: Scene, weights: np.ndarray, per_share: float, defocus: Defocus) -> tuple[float, ...]:
    """Return `SceneContrast.edges`: quantiles MOST, of layers at rest and of what is behind the first one.

    The noise is that of the photosite on the darker side of an edge. A slope counts by its change from pixel to pixel: with n
    samples per photosite it is wrong by at most scale^2 / (6 n^2) of that, edges by 2.5 / (6 n) of them. Large scenes are
    searched in bands of rows.
    weights, per_share: as of `scene_contrast`.
    """
    side, to_share = max(1, round(defocus.scale)), per_share * weights
    size, columns = scene.planes.shape[:2]
    high = min(4 * side, size)
    bands = np.linspace(0, size - high, max(1, min(MOST_EDGES // (high * columns), -(-size // high)))).astype(int)
    places = bands[:, None] + np.arange(high)
    layers, found = [layer_at(layer, (places,), to_share) for layer in scene.layers], np.zeros(len(LITS))
    for number in range(min(len(layers), 2)):
        light = composite(layers[number:])  # (bands, rows, columns, channels)
        mean = window_mean(light, side, "nearest", axes=(1, 2))
        for axis in (1, 2):
            step = np.diff(light, axis=axis)
            if light.shape[axis] < 3:
                continue
            bend = np.abs(np.diff(step, axis=axis))
            most = max(OF_BEND * defocus.scale**2, 1.0) * np.maximum(
                *(shifted(bend, axis, way, step.shape[axis]) for way in (-1, 0))
            )
            step = np.clip(step, -most, most)
            before, after = (shifted(mean, axis, way, step.shape[axis]) for way in (-(side // 2), 1 + (side - 1) // 2))
            dark = np.where(step > 0.0, before, after)
            for place, lit in enumerate(LITS):
                seen = seen_contrast(step, dark + lit * np.abs(step), defocus.accuracy).max(axis=-1)
                found[place] = max(found[place], float(np.quantile(seen, MOST, method="higher")))
    return tuple(found.tolist())
