"""Layers behind a low-pass filter that kernels by distance hold: its spots see other parts of them than their means show.

A photosite sees the mean over the four spots of (1 - c) L, with the coverage c of a layer and the light L behind it. Kernels
that hold the filter give (1 - mean(c)) mean(L), which lacks the covariance of both over the spots. It is found from the scene:
its layers behind the images of the aperture, at the places of the spots, linear between pixels.
"""

import itertools

import numpy as np

from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.scene_contrast import layer_at, parts_of
from simulator.optics.defocus.scene_light import MOST, composite, seen_contrast
from simulator.scene.scene import Scene

WIDEST_PX = 6.0  # larger images of the aperture count as these [pixels]

Place = tuple[slice, slice]
Surface = tuple[np.ndarray, np.ndarray | None]  # light (rows, columns, channels) times coverage, and coverage; None: it is 1


def filtered_layers_error(scene: Scene, to_share: np.ndarray, defocus: Defocus, apart_px: float) -> float:
    """Error of kernels that hold the filter, as a share of the brightest light: its quantile MOST; of a large scene, of parts.

    to_share: (bands, channels) of scene planes in shares of the brightest light. defocus: blur of the layers, of which one
    whose radius varies counts with its smallest one in a part. apart_px: distance of the spots on either axis [photosites].
    """
    away, found = 0.5 * apart_px * defocus.scale, [np.zeros(1)]
    for place in parts_of(scene, defocus.scale):
        layers = _blurred(scene, to_share, defocus, place)
        spots = [[_shifted(one, *spot) for one in layers] for spot in itertools.product((-away, away), repeat=2)]
        seen = np.mean([composite(one) for one in spots], axis=0)
        means = [_mean([one[number] for one in spots]) for number in range(len(layers))]
        found.append(seen_contrast(composite(means) - seen, seen, defocus.accuracy).ravel())
    return float(np.quantile(np.concatenate(found), MOST))


def _blurred(scene: Scene, to_share: np.ndarray, defocus: Defocus, place: Place) -> list[Surface]:
    from scipy.ndimage import convolve

    found = []
    for layer, radius in zip(scene.layers, defocus.radii_px, strict=False):
        radius_px = np.abs(radius[place]).min() if isinstance(radius, np.ndarray) else abs(radius)
        weights = disk_weights(min(float(radius_px) * defocus.scale, WIDEST_PX))
        light, coverage = layer_at(layer, place, to_share)
        behind = convolve(light.astype(np.float64), weights[..., None], mode="nearest")
        found.append((behind, None if coverage is None else convolve(coverage.astype(np.float64), weights, mode="nearest")))
    return found


def _shifted(layer: Surface, down: float, right: float) -> Surface:
    """Return a layer as photosites see it from so many pixels away."""
    from scipy.ndimage import shift

    light, coverage = layer
    moved = None if coverage is None else shift(coverage, (down, right), order=1, mode="nearest")
    return shift(light, (down, right, 0.0), order=1, mode="nearest"), moved


def _mean(layers: list[Surface]) -> Surface:
    covers = [coverage for _, coverage in layers if coverage is not None]
    return np.mean([light for light, _ in layers], axis=0), np.mean(covers, axis=0) if covers else None
