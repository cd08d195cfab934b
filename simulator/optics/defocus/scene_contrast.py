"""Contrasts of a scene on which the errors of its blur depend."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import STEEPEST_PX, Defocus
from simulator.scene.occluded_background import EDGE_PX, MOST_ESTIMATED, depth_edges
from simulator.scene.scene import Layer, Scene, is_depth_map

MOST = 0.999  # quantile that counts as the greatest contrast
LAMP = 2.0  # brightest lights of which a single pixel is a lamp
_STRIPS = 200  # strips of rows in which a scene's curvature is measured
_WIDEST_PX = 129  # widest surroundings of a depth edge whose mean is its background [pixels of the thinned picture]


@dataclass(frozen=True)
class SceneContrast:
    """Contrasts as shares of the brightest light; the defaults are the largest that the laws of the blur assume.

    Where the light is weaker, and with it the noise, a difference counts as much more as it is seen more clearly.

    curvature: second difference of the light between photosites.
    lamp: light of the brightest blur spot of a single scene pixel that is LAMP times as bright as the brightest light.
    beside: deviation of the light beside depth edges from its mean around them, that of lamps left out; 0.5 where it varies by
        its whole range. behind: the same, where the scene does not hold what is hidden; 0: it does.
    has_steps: whether a surface has steps in depth, so that it occludes parts of itself.
    """

    curvature: float = 1.0
    lamp: float = 0.0
    beside: float = 0.5
    behind: float = 0.0
    has_steps: bool = False


def scene_contrast(scene: Scene, weights: np.ndarray, per_share: float, defocus: Defocus) -> SceneContrast:
    """Measure the contrasts of a scene as it is loaded, without a background that is only assumed.

    weights: (bands, channels) of scene planes in electron radiance. per_share: shares of the brightest light per electron
    radiance. defocus: blur of the scene.
    """
    to_share = per_share * weights
    layers = list(zip(scene.layers, defocus.radii_px, strict=False))
    curvature = max(_curvature(layer.planes, to_share, defocus) for layer, _ in layers)
    lamp = max(_brightest_spot(layer, to_share, radius, defocus.scale, defocus.accuracy.sharp_px) for layer, radius in layers)
    has_steps = any(_has_steps(radius, defocus.scale) for _, radius in layers)
    beside = _beside_edges(scene, to_share, defocus) if has_steps else 0.0
    return SceneContrast(curvature, lamp, beside, beside if defocus.guessed else 0.0, has_steps)


def _seen(difference: np.ndarray, light: np.ndarray, accuracy: Accuracy) -> np.ndarray:
    """Difference of light that is as many standard deviations of the noise at the brightest light as it is at its own place."""
    noise = accuracy.electrons * np.maximum(light, 0.0) + accuracy.read_noise_e**2
    return np.abs(difference) * np.sqrt((accuracy.electrons + accuracy.read_noise_e**2) / np.maximum(noise, 1.0))


def _curvature(planes: np.ndarray, to_share: np.ndarray, defocus: Defocus) -> float:
    """Quantile MOST of the second difference between photosites, in the scene's strips of three photosites' height."""
    side, (rows, columns, _) = max(1, round(defocus.scale)), planes.shape
    if min(rows, columns) < 3 * side:
        return 0.0
    found = []
    for top in np.unique(np.linspace(0, rows - 3 * side, _STRIPS).astype(int)):
        strip = planes[top : top + 3 * side, : columns // side * side]
        light = strip.reshape(3, side, columns // side, side, -1).mean(axis=(1, 3)) @ to_share
        across, down = np.diff(light, 2, axis=1)[1], np.diff(light, 2, axis=0)[0, 1:-1]
        found.append(_seen(np.maximum(np.abs(across), np.abs(down)), light[1, 1:-1], defocus.accuracy).max(axis=1))
    return float(np.quantile(np.concatenate(found), MOST)) * min(defocus.scale, 1.0)


def _brightest_spot(layer: Layer, to_share: np.ndarray, radius_px: float | np.ndarray, scale: float, sharp_px: float) -> float:
    """Light of a pixel above the brightest light, on the area of its blur circle: the largest of the layer.

    sharp_px: blur radius up to which a pixel is copied.
    """
    bright = (layer.planes > 1.0 / np.maximum(to_share.sum(axis=1) * layer.planes.shape[2], 1e-30)).any(axis=2)
    if isinstance(radius_px, np.ndarray):
        bright &= np.abs(radius_px) > sharp_px
    rows, columns = np.nonzero(bright)
    if not len(rows) or (not isinstance(radius_px, np.ndarray) and abs(radius_px) <= sharp_px):
        return 0.0
    light = (layer.planes[rows, columns] @ to_share).max(axis=1)
    light = np.where(light > LAMP, light, 0.0)
    own = radius_px[rows, columns] if isinstance(radius_px, np.ndarray) else radius_px
    spot_px = math.pi * np.maximum(np.abs(own), 0.5) ** 2
    narrow = min(scale, 1.0 / scale) ** 2  # a pixel wider than a photosite has soft edges, one that is narrower little light
    return narrow * float((np.maximum(light - 1.0, 0.0) / spot_px).max())


def _has_steps(radius_px: float | np.ndarray, scale: float) -> bool:
    """Whether the radius changes by more than a continuous surface's between neighbouring photosites."""
    if not isinstance(radius_px, np.ndarray):
        return False
    least = min(EDGE_PX, STEEPEST_PX / scale)
    return any(bool((np.abs(np.diff(radius_px, axis=axis)) > least).any()) for axis in (0, 1))


def _beside_edges(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> float:
    """Quantile 0.99 of the light's deviation from its mean around it, where a depth edge lies within the largest radius.

    Of a scene of one picture; of several layers, that of the laws.
    """
    from scipy.ndimage import uniform_filter

    if scene.behind or not is_depth_map(scene.depth_m):
        return SceneContrast().beside
    every = math.ceil(math.sqrt(scene.depth_m.size / MOST_ESTIMATED))
    light = np.minimum((scene.planes[::every, ::every] @ to_share).max(axis=2), LAMP)
    radius = defocus.radii_px[0]
    assert isinstance(radius, np.ndarray)  # depth is a map, and steps were found in its radius
    edges = depth_edges(-radius[::every, ::every], min(EDGE_PX, STEEPEST_PX / defocus.scale))
    width = min(2 * math.ceil(defocus.largest_px * defocus.scale / every) + 1, _WIDEST_PX)
    around = uniform_filter((edges.near | edges.far).astype(np.float32), width) > 0.5 / width**2
    mean = uniform_filter(light, width)
    deviation = _seen(light - mean, mean, defocus.accuracy)[around]
    return float(np.quantile(deviation, 0.99)) if deviation.size else 0.0
