"""Surfaces that bend within a blur circle: what their means miss, since they take a surface for a plane there.

Through the point u of the pupil a photosite at x sees the light L at x + s u, where s is the radius of the surface that the ray
meets. Of a plane that is known at x. What a surface's radius has beyond it, d, moves the ray by u d, so that the mean is wrong
by E[grad L . u d]. With the even and the odd parts of grad L and d around x only the products of unlike ones are left, and of
each at most the product of the roots of their mean squares (Cauchy and Schwarz' inequality):

    rms(grad L) rms(odd d) + deviation(grad L) rms(even d)    [over the circle].

Where the scene's own pixels are gathered, the image on a plane of the slope g is the upright one moved by s g / 4, the mean of
s u (g . u). What is left of that, even in u, has the root mean square s |g| sqrt(1/6 - 1/16), of rays uniform in a round pupil.

Behind circles smaller than a pixel light crosses the borders of a photosite's even squares alone: 2 s / 3 pi of the step there,
the mean of the positive part of s u. There s is linear from pixel to pixel: on the cliff where a depth map leaps through the
focus rays meet a surface in focus.

Planes end with the scene, beyond which it goes on as it ends. There the rays themselves are followed.
"""

import itertools
import math
from collections.abc import Callable

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.path_contrast import parts_of
from simulator.optics.defocus.scene_light import MOST, layer_at, seen_contrast, shifted
from simulator.optics.defocus.sobol_points import sobol_points
from simulator.optics.geometry.scene_part import ScenePart
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.scene import Layer, Scene

DIRECTIONS, RINGS = 8, (0.5, 1.0)  # of places in a circle at which surfaces are compared with planes; in its radius
OF_MOVED = math.sqrt(1.0 / 6.0 - 1.0 / 16.0)  # of slope times radius
WIDER = 1.5  # factor from one width over which slopes of the light are averaged to the next
RAYS, MOST_AT_BORDER = 128, 512  # of a photosite at the border; photosites that are looked at
MOST_SEARCHED = 1_000_000  # pixels that are asked whether their circles reach the border
MEETS = 3  # steps in which a ray finds the surface
STEEPEST = 0.1  # least part of a plane's slope that a ray leaves
OF_CROSSED = 2.0 / (3.0 * math.pi)  # of a step at a border and the radius there: mean of the positive part of a pupil's width


def surface_bend(scene: Scene, to_share: np.ndarray, defocus: Defocus, seen: ScenePart) -> float:
    """Error of taking surfaces for planes that MOST of the photosites stay below, as a share of the brightest light.

    Of each layer in its own light, that of lamps left out; of a large scene parts are looked at. to_share: (bands, channels) of
    scene planes in shares of the brightest light. seen: the part before photosites.
    """
    is_moved, inside, at_border = bool(defocus.gathers_scene(np.zeros(1), np.zeros(1)).any()), [np.zeros(1)], 0.0
    for layer, radius in zip(scene.layers, defocus.radii_px, strict=False):
        if not isinstance(radius, np.ndarray):
            continue

        def light_of(pixels: np.ndarray, layer: Layer = layer) -> np.ndarray:
            return layer_at(layer, tuple(pixels), to_share)[0]

        for place in parts_of(scene, defocus.scale):
            light, _ = layer_at(layer, place, to_share)
            own = bent_error(light, radius[place], defocus.scale, defocus.accuracy, is_moved=is_moved)
            if defocus.accuracy.detail:  # even squares
                own = own + crossed_error(light, radius[place], defocus.scale, defocus.accuracy, is_moved=is_moved)
            inside.append(own.ravel())
        own, share = border_errors(light_of, radius, defocus.scale, defocus.accuracy, defocus.pupil, seen)
        if share > 1.0 - MOST:  # what fewer photosites exceed is not counted
            at_border = max(at_border, float(np.quantile(own, 1.0 - (1.0 - MOST) / share)))
    return float(np.quantile(np.concatenate(inside), MOST)) + at_border


def bent_error(light: np.ndarray, radius_px: np.ndarray, scale: float, accuracy: Accuracy, *, is_moved: bool) -> np.ndarray:
    """Error of taking a surface for a plane, (rows, columns, channels), as a share of the brightest light in its own noise.

    light: (rows, columns, channels) of pixels, in shares of the brightest light. radius_px: (rows, columns), signed blur radius
    [photosites]. scale: pixels per photosite. is_moved: whether images on planes are upright ones that are moved.
    """
    from scipy.ndimage import uniform_filter

    side = max(round(scale), 1)
    seen = uniform_filter(light.astype(np.float64), side, mode="nearest", axes=(0, 1))
    slopes = [scale * np.gradient(seen, axis=axis) for axis in (0, 1)]  # per photosite
    odd, even, steep = _beyond_planes(radius_px.astype(np.float64), scale)
    if is_moved:
        even = even + OF_MOVED * np.abs(radius_px) * steep
    square, deviation = _over_circles(slopes, np.abs(radius_px), scale)
    moved = np.sqrt(square) * odd[..., None] + np.sqrt(deviation) * even[..., None]
    noise_e2 = accuracy.electrons * np.maximum(seen, 0.0) + accuracy.read_noise_e**2
    return np.asarray(moved * np.sqrt((accuracy.electrons + accuracy.read_noise_e**2) / np.maximum(noise_e2, 1.0)))


def crossed_error(light: np.ndarray, radius_px: np.ndarray, scale: float, accuracy: Accuracy, *, is_moved: bool) -> np.ndarray:
    """Error of the radius at a photosite's borders, of even squares behind circles smaller than these: as of `bent_error`.

    It is that of photosites around each pixel. Images of a plane that are upright ones have one radius at all borders.
    """
    from scipy.ndimage import uniform_filter

    side, found = max(round(scale), 1), np.zeros(light.shape)
    if scale * float(np.abs(radius_px).min()) > 1.0:
        return found
    radius, light = radius_px.astype(np.float64), light.astype(np.float64)
    slopes = [0.0 * radius if is_moved else _difference(radius, side, axis) for axis in (0, 1)]  # per pixel
    middle = 0.5 * (side - 1) - side // 2  # of a photosite, from its pixel [px]
    middles = uniform_filter(radius, 2 - side % 2, mode="nearest")  # radii there
    for axis, size in enumerate(radius.shape):
        other = radius.shape[1 - axis]
        for first, way in ((-(side // 2), -1), (side - side // 2, 1)):  # of the pixels behind a border; to its outer side
            step = way * (shifted(light, axis, first, size) - shifted(light, axis, first - 1, size))
            between_px = 0.5 * (shifted(radius, axis, first, size) + shifted(radius, axis, first - 1, size))
            size_px = _along_border(between_px, 1 - axis)
            for along in range(-(side // 2), side - side // 2):
                own = middles + (first - 0.5 - middle) * slopes[axis] + (along - middle) * slopes[1 - axis]
                own = sum(0.5 * np.abs(own + part * slopes[1 - axis]) for part in (-0.25, 0.25))
                there = shifted(size_px, 1 - axis, along, other)
                missed = np.where(scale * np.maximum(there, own) <= 1.0, there - own, 0.0)
                found += shifted(step, 1 - axis, along, other) * missed[..., None]
    seen = uniform_filter(light, side, mode="nearest", axes=(0, 1))
    return seen_contrast(OF_CROSSED / side * found, seen, accuracy)


def _along_border(signed_px: np.ndarray, axis: int) -> np.ndarray:
    """Mean size of radii along the width of each pixel at a border that goes along this axis, linear from pixel to pixel."""
    beside = (shifted(signed_px, axis, way, signed_px.shape[axis]) for way in (-1, 1))
    return np.asarray(sum(0.5 * np.abs(0.75 * signed_px + 0.25 * one) for one in beside))


def border_errors(
    light_of: Callable[[np.ndarray], np.ndarray],
    radius_px: np.ndarray,
    scale: float,
    accuracy: Accuracy,
    pupil: Pupil,
    seen: ScenePart,
) -> tuple[np.ndarray, float]:
    """Error of going on with planes beyond the border, of some photosites whose circles reach it, and the share of all.

    The first is (photosites, channels), as a share of the brightest light in their own noise. light_of: light (..., channels)
    of pixels (2, ...), in shares of the brightest light. radius_px: of all pixels of a scene. seen: those before photosites.
    scale, accuracy: as of `bent_error`.
    """
    place, share = _at_border(radius_px, scale, seen)
    last, side = np.array(radius_px.shape)[:, None, None] - 1, max(round(scale), 1)
    place = place[:, None, :]

    def radius_at(where: np.ndarray) -> np.ndarray:
        return np.asarray(radius_px[*np.clip(np.rint(where).astype(np.intp), 0, last)])

    beside = [radius_at(place + side * np.array(way)[:, None, None]) for way in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    slope = np.stack([beside[0] - beside[1], beside[2] - beside[3]]) * (0.5 * scale / side)  # per photosite
    points = sobol_points(RAYS).T
    way = np.stack(pupil.map_unit_square(*points[:2])[::-1])[:, :, None]
    # Between the middles of squares as wide as a photosite light is linear; wider photosites are means of several.
    within = (np.floor(side * points[2:4, :, None]) - 0.5 * (side - 1)) / scale
    own = place + scale * within
    of_plane = (radius_at(place) + (slope * within).sum(axis=0)) / np.maximum(1.0 - (slope * way).sum(axis=0), STEEPEST)
    met = of_plane
    for _ in range(MEETS):
        met = radius_at(own + scale * met * way)
    plane, blurred = (_between_pixels(light_of, own + scale * px * way, last).mean(axis=0) for px in (of_plane, met))
    return seen_contrast(plane - blurred, blurred, accuracy), share


def _between_pixels(light_of: Callable[[np.ndarray], np.ndarray], where: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Light at places (2, ...), linear between pixels, of a scene that goes on as it ends."""
    low = np.floor(where)
    part = where - low
    found = np.zeros(())
    for down, right in itertools.product((0, 1), (0, 1)):
        pixel = np.clip(low.astype(np.intp) + np.array([down, right])[:, None, None], 0, last)
        share = np.abs(1 - down - part[0]) * np.abs(1 - right - part[1])
        found = found + share[..., None] * light_of(pixel)
    return found


def _at_border(radius_px: np.ndarray, scale: float, seen: ScenePart) -> tuple[np.ndarray, float]:
    """Pixels (2, any), evenly spread over those seen whose circles reach beyond the border of the scene; the share of these."""
    every = math.ceil(math.sqrt(seen.height * seen.width / MOST_SEARCHED))
    rows, columns = np.arange(seen.y, seen.y + seen.height, every), np.arange(seen.x, seen.x + seen.width, every)
    away = [np.minimum(own, size - 1 - own) for own, size in zip((rows, columns), radius_px.shape, strict=True)]
    reached = np.minimum(away[0][:, None], away[1]) < scale * np.abs(radius_px[np.ix_(rows, columns)])
    row, column = np.nonzero(reached)
    step = max(-(-len(row) // MOST_AT_BORDER), 1)
    return np.stack([rows[row[::step]], columns[column[::step]]]), float(reached.mean())


def _beyond_planes(radius_px: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roots of the mean squares of what radii have beyond planes within circles, odd and even around their middles; slopes.

    A plane has the slope between the photosites beside its middle [photosites per photosite].
    """
    last = np.array(radius_px.shape)[:, None, None] - 1
    middle = np.indices(radius_px.shape)

    def at(away_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radius at the pixels nearest to places (2, rows, columns) beside the middle, and what a plane has there beyond it."""
        place = np.clip(np.rint(middle + scale * away_px).astype(np.intp), 0, last)
        return radius_px[*place], (slope * (place - middle)).sum(axis=0) / scale

    slope = np.stack([scale * _difference(radius_px, max(round(scale), 1), axis) for axis in (0, 1)])
    odd, even, count = np.zeros(radius_px.shape), np.zeros(radius_px.shape), 0
    for ring in RINGS:
        for angle in np.arange(DIRECTIONS // 2) * 2.0 * math.pi / DIRECTIONS:
            away = ring * np.abs(radius_px) * np.array([math.sin(angle), math.cos(angle)])[:, None, None]
            (before, plane_before), (behind, plane_behind) = at(-away), at(away)
            odd += 0.25 * (behind - before - plane_behind + plane_before) ** 2
            even += (0.5 * (behind + before - plane_behind - plane_before) - radius_px) ** 2
            count += 1
    return np.sqrt(odd / count), np.sqrt(even / count), np.hypot(*slope)


def _difference(values: np.ndarray, side: int, axis: int) -> np.ndarray:
    """Mean slope from so many pixels before each to so many behind it, of those that there are."""
    size = values.shape[axis]
    before, behind = np.maximum(np.arange(size) - side, 0), np.minimum(np.arange(size) + side, size - 1)
    span = np.expand_dims(np.maximum(behind - before, 1), 1 - axis)
    return np.asarray((np.take(values, behind, axis=axis) - np.take(values, before, axis=axis)) / span)


def _over_circles(slopes: list[np.ndarray], size_px: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean square of the light's slope over squares as wide as circles of these radii, and its variance."""
    from scipy.ndimage import uniform_filter

    widths = np.maximum(2.0 * size_px * scale + 1.0, 1.0)
    steps = np.ceil(np.log(widths) / math.log(WIDER)).astype(int)
    square, deviation = np.zeros(slopes[0].shape), np.zeros(slopes[0].shape)
    for step in np.unique(steps).tolist():
        width, here = min(math.ceil(WIDER**step), max(size_px.shape)), steps == step
        means = [uniform_filter(slope, width, mode="nearest", axes=(0, 1)) for slope in slopes]
        squares = sum(uniform_filter(slope**2, width, mode="nearest", axes=(0, 1)) for slope in slopes)
        square[here] = np.maximum(squares, 0.0)[here]
        deviation[here] = np.maximum(squares - sum(mean**2 for mean in means), 0.0)[here]
    return square, deviation
