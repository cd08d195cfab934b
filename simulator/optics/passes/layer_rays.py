"""Adds by rays, on the reference path, what kernels by distance lack that spread each layer of a scene by itself.

Means of layers are composited. What hides and what is hidden vary together over the aperture, and over the spread that all
distances have in common: that of the kernel in focus. Rays that start where this lets a photosite's light come from, and go
through any point of the pupil, meet the layers front to back. Their mean, less the composite of each layer's mean over the same
rays, is what the kernels lack; most of the rays' noise is in both.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.reference_mosaic import Grid, Sample, converged_mosaic, patterns_of
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.kernel_split import gather_table
from simulator.optics.ray_reference.convergence import RaySet
from simulator.optics.ray_reference.layered_rays import LayeredRays, ray_samples, upload_surfaces
from simulator.sensor.camera.camera_sections import Window

LEAST_CELLS = 4  # of a photosite and axis, in each of which rays start evenly
LEAST_PART = 1e-4  # sum of weights below 0 from which rays start there, too
KEPT_SETS = 16  # of rays, of each colour, for the next band


def add_layer_rays(
    optics: OpticsPlan, device: Device, planes: Sequence[Buffer], light: Buffer, progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: a mosaic of layers that kernels spread one by one, with what these lack.

    light: that mosaic. planes: as for `psf_mosaic`. Rays are added, and warned of, as by `reference_mosaic`.
    """
    frame, psf = optics.window, optics.psf
    assert psf is not None and optics.defocus is not None  # else no kernel spreads a layer
    spread = device.download(light, (frame.height, frame.width), np.float32)
    eyes, pupil, in_focus = optics.defocus.eyes, optics.defocus.pupil, psf.of_one_radius(0.0)
    grid = Grid(optics, device, list(planes), in_focus.reach_px + 1)
    parts = {channel: _parts(in_focus, channel) for channel in optics.cfa.colors}

    @lru_cache(maxsize=KEPT_SETS * len(parts))
    def points(rays: int, seed: int, channel: int) -> list[tuple[float, np.ndarray]]:
        through = ray_samples(rays, patterns_of(rays), seed, pupil)
        return [
            (weight, np.concatenate([start(through[..., :2]), through[..., 2:]], axis=-1)) for weight, start in parts[channel]
        ]

    def of_band(window: Window) -> Sample:
        block = optics.cfa.block(window.x, window.y)
        colour, coverage, radius = grid.band(window)

        def through(colour: np.ndarray, coverage: np.ndarray, radius_px: np.ndarray) -> LayeredRays:
            surfaces = upload_surfaces(device, colour, coverage, radius_px, grid.margin_px, grid.over)
            return LayeredRays(surfaces, device, grid.margin_px, window, grid.over, block, eyes)

        together, whole = through(colour, coverage, radius), np.ones_like(coverage[:1])
        each = [through(colour[[n]], whole, radius[[n]]) for n in range(len(colour))]
        covered = [
            None if coverage[n].min() == 1.0 else through(np.broadcast_to(coverage[n], colour[[n]].shape), whole, radius[[n]])
            for n in range(len(colour))
        ]
        own = spread[window.y - frame.y :][: window.height].astype(np.float64).ravel()
        y, x = np.divmod(np.arange(own.size), window.width)
        channels = np.array(block)[y % 2, x % 2]

        def sample(rays: RaySet, places: np.ndarray) -> np.ndarray:
            found = own[places]
            for channel in np.unique(channels[places]).tolist():
                mine = np.flatnonzero(channels[places] == channel)

                def mean(layers: LayeredRays, some: np.ndarray = places[mine], channel: int = channel) -> np.ndarray:
                    of_parts = points(rays.rays, rays.seed, channel)
                    return np.sum([weight * layers.sample(one, some) for weight, one in of_parts], axis=0)

                means, open_ = np.zeros(len(mine)), np.ones(len(mine))
                for layer, cover in zip(each, covered, strict=True):
                    means += open_ * mean(layer)
                    if cover is None:
                        break
                    open_ *= 1.0 - mean(cover)
                found[mine] += mean(together) - means
            return found

        return sample

    return device.upload(np.maximum(converged_mosaic(frame, optics.accuracy, of_band, progress), np.float32(0.0)))


def _parts(psf: FieldPsf, channel: int) -> list[tuple[float, Callable[[np.ndarray], np.ndarray]]]:
    """Where rays start, where weights of the light around a photosite are above 0 and below, with the sum of either's weights.

    psf: in focus. The sums are 1 together; weights below 0 are those of samples that ring, as large as photosites.
    """
    weights, per_photosite = _density(psf, channel)
    weights /= weights.sum()
    halves = [(sign, np.maximum(sign * weights, 0.0)) for sign in (1.0, -1.0)]
    return [(sign * half.sum(), _starts(half, per_photosite)) for sign, half in halves if half.sum() > LEAST_PART]


def _starts(weights: np.ndarray, per_photosite: int) -> Callable[[np.ndarray], np.ndarray]:
    """Function from points of the unit square (..., 2) to where rays start, x and y from a photosite's corner [photosites].

    As many start in each cell around it as its weight, evenly. weights: (n, n), at least 0, so many to a photosite.
    """
    borders = (np.arange(len(weights) + 1) - (len(weights) - per_photosite) // 2) / per_photosite
    rows = np.append(0.0, np.cumsum(weights.sum(axis=1)))
    columns = np.pad(np.cumsum(weights, axis=1), ((0, 0), (1, 0)))
    columns /= np.maximum(columns[:, -1:], 1e-300)
    every = (columns + np.arange(len(columns))[:, None]).ravel(), np.tile(borders, len(columns))

    def start(points: np.ndarray) -> np.ndarray:
        down = np.interp(points[..., 1], rows / rows[-1], np.arange(len(rows)))
        row = np.minimum(down.astype(int), len(weights) - 1)
        right = np.interp(row + np.clip(points[..., 0], 1e-6, 1.0 - 1e-6), *every)
        return np.stack([right, np.interp(down, np.arange(len(rows)), borders)], axis=-1).astype(np.float32)

    return start


def _density(psf: FieldPsf, channel: int) -> tuple[np.ndarray, int]:
    """Weights of the light around a photosite (n, n), and how many there are to a photosite and axis.

    Those of each sample are that of the kernel together, spread over it as finer samples would be: small circles, which cross
    the borders of samples, see no steps there.
    """
    own = gather_table(psf.kernel(0, channel, False, 0, 0))
    finer = max(LEAST_CELLS // psf.over, 1)
    within = gather_table(replace(psf, over=finer * psf.over).kernel(0, channel, False, 0, 0))
    away = (len(within) - finer * len(own)) // 2
    within = np.pad(within, max(-away, 0))[max(away, 0) :, max(away, 0) :][: finer * len(own), : finer * len(own)]
    within = np.maximum(within, 0.0).reshape(len(own), finer, len(own), finer)
    share = own / np.maximum(within.sum(axis=(1, 3)), 1e-300)
    return (within * share[:, None, :, None]).reshape(finer * len(own), -1), finer * psf.over
