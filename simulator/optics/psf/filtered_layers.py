"""Layers behind kernels by distance: photosites see other parts of them together than their means show.

A photosite sees the mean of (1 - c) L over a kernel, with the coverage c of a layer and the light L behind it. Kernels by
distance give (1 - mean(c)) mean(L), which lacks the covariance of both: over the four spots of a low-pass filter that kernels
hold, and over the spread that all of them share, of diffraction, aberrations and the open area of a photosite. It is found from
the scene: its layers behind the images of the aperture, linear between pixels for a filter, even squares for kernels.
"""

import itertools
import math

import numpy as np

from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.path_contrast import parts_of
from simulator.optics.defocus.scene_light import MOST, composite, layer_at, seen_contrast, shifted
from simulator.scene.scene import Scene

WIDEST_PX = 6.0  # larger images of the aperture count as these [pixels]
POINTS = 32  # of the aperture
CELLS = 2  # least number of squares to a photosite and axis

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


def spread_layers_error(scene: Scene, to_share: np.ndarray, defocus: Defocus, kernel: np.ndarray, per_photosite: int) -> float:
    """Error of kernels that spread each layer by itself, as a share of the brightest light, as of `filtered_layers_error`.

    The truth is what layers show together through points of the aperture, spread by the kernel in focus, which diffraction and
    open area leave of each distance. Of several layers out of focus kernels add the covariance over the aperture, but spread it
    over a photosite alone (`Method.CORRECTED`).
    kernel: (n, n) weights of the light around a photosite, in focus, so many to a photosite and axis, of `gather_table`.
    """
    finer = math.ceil(CELLS / defocus.scale)
    weights, area = _resampled(kernel, per_photosite, finer * defocus.scale), _square(finer * defocus.scale)
    found = [np.zeros(1)]
    for place in parts_of(scene, defocus.scale):
        radii_px = [_radius_in(place, radius, defocus.scale) for radius in defocus.radii_px]
        layers = [_divided(layer_at(layer, place, to_share), finer) for layer in scene.layers]
        together, each = _through_points(layers, [finer * radius for radius in radii_px])
        means = [(_spread(light, weights), None if cover is None else _spread(cover, weights)) for light, cover in each]
        seen, added = _spread(together, weights), _spread(together - composite(each), area)
        found.append(seen_contrast(composite(means) + added - seen, seen, defocus.accuracy).ravel())
    return float(np.quantile(np.concatenate(found), MOST))


def _radius_in(place: Place, radius_px: np.ndarray | float, scale: float) -> float:
    """Signed blur radius of a layer in a part of it [pixels], at most WIDEST_PX; the smallest of those that vary."""
    own = np.ravel(radius_px[place] if isinstance(radius_px, np.ndarray) else radius_px)
    return float(np.clip(scale * own[np.argmin(np.abs(own))], -WIDEST_PX, WIDEST_PX))


def _through_points(layers: list[Surface], radii_px: list[float]) -> tuple[np.ndarray, list[Surface]]:
    """Mean over points of the aperture of what layers show together, and of each layer by itself.

    radii_px: of their blur circles, in their own pixels, whose nearest is read.
    """
    number = np.arange(POINTS) + 0.5
    radius, angle = np.sqrt(number / POINTS), math.pi * (3.0 - math.sqrt(5.0)) * number  # a sunflower's seeds
    seen = []
    for down, right in (radius * np.array([np.sin(angle), np.cos(angle)])).T:
        seen.append(
            [_read_aside(one, round(own * down), round(own * right)) for one, own in zip(layers, radii_px, strict=True)]
        )
    return np.mean([composite(one) for one in seen], axis=0), [_mean([one[n] for one in seen]) for n in range(len(layers))]


def _read_aside(layer: Surface, down: int, right: int) -> Surface:
    """Return a layer as it is so many pixels away; it goes on as it ends."""
    light, coverage = (
        None if plane is None else shifted(shifted(plane, 0, down, plane.shape[0]), 1, right, plane.shape[1]) for plane in layer
    )
    assert light is not None  # every layer has some
    return light, coverage


def _square(side_px: float) -> np.ndarray:
    """Weights of a square of so many pixels around the middle of one, (n, n), sum 1."""
    reach = math.ceil(0.5 * (side_px - 1.0))
    line = np.clip(0.5 * (side_px + 1.0) - np.abs(np.arange(-reach, reach + 1)), 0.0, 1.0) / side_px
    return np.outer(line, line)


def _resampled(kernel: np.ndarray, from_px: int, to_px: float) -> np.ndarray:
    """Return a kernel with so many values to a photosite in place of others, (n, n), sum 1."""
    from scipy.ndimage import map_coordinates

    reach = math.floor(len(kernel) // 2 * to_px / from_px)
    places = np.arange(-reach, reach + 1) * (from_px / to_px) + 0.5 * (len(kernel) - 1)
    found = np.maximum(map_coordinates(kernel, np.meshgrid(places, places, indexing="ij"), order=1), 0.0)
    return np.asarray(found / found.sum())


def _divided(layer: Surface, finer: int) -> Surface:
    """Return a layer with so many equal squares in place of each pixel, along each axis."""
    light, coverage = layer

    def divided(plane: np.ndarray) -> np.ndarray:
        return plane.repeat(finer, axis=0).repeat(finer, axis=1)

    return divided(light), None if coverage is None else divided(coverage)


def _spread(plane: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Mean of a plane (rows, columns, ...) over weights around each place; it goes on as it ends."""
    from scipy.signal import fftconvolve

    reach, aside = len(weights) // 2, ((0, 0),) * (plane.ndim - 2)
    wide = np.pad(plane.astype(np.float64), ((reach, reach), (reach, reach), *aside), mode="edge")
    turned = weights[::-1, ::-1]
    return np.asarray(fftconvolve(wide, turned[(...,) + (None,) * (plane.ndim - 2)], mode="valid", axes=(0, 1)))


def _blurred(scene: Scene, to_share: np.ndarray, defocus: Defocus, place: Place) -> list[Surface]:
    from scipy.ndimage import convolve

    found = []
    for layer, radius in zip(scene.layers, defocus.radii_px, strict=False):
        weights = disk_weights(_radius_in(place, radius, defocus.scale))
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
