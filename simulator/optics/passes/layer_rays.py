"""Adds by rays, on the reference path, what kernels by distance lack that spread each layer of a scene by itself.

Means of layers are composited. What hides and what is hidden vary together over the aperture, and over the spread that all
distances have in common: that of the kernel in focus. Rays that start where this lets a photosite's light come from, and go
through any point of the pupil, meet the layers front to back. Their mean, less the composite of each layer's mean over the same
rays, is what the kernels lack; most of the rays' noise is in both.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.reference_mosaic import Grid, Sample, converged_mosaic, patterns_of
from simulator.optics.psf.kernel_split import gather_table
from simulator.optics.ray_reference.convergence import RaySet
from simulator.optics.ray_reference.layered_rays import LayeredRays, ray_samples, upload_surfaces
from simulator.sensor.camera.camera_sections import Window

NEAR_PX = 4  # of the kernel in focus, over which layers vary together [photosites]
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
    grid, eyes, pupil = Grid(optics, device, list(planes), NEAR_PX + 1), optics.defocus.eyes, optics.defocus.pupil
    starts = {channel: _starts(optics, channel) for channel in optics.cfa.colors}

    @lru_cache(maxsize=KEPT_SETS * len(starts))
    def points(rays: int, seed: int, channel: int) -> np.ndarray:
        found = ray_samples(rays, patterns_of(rays), seed, pupil)
        found[..., :2] = starts[channel](found[..., :2])
        return found

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
                some, through_points = places[mine], points(rays.rays, rays.seed, channel)
                means, open_ = np.zeros(len(mine)), np.ones(len(mine))
                for layer, cover in zip(each, covered, strict=True):
                    means += open_ * layer.sample(through_points, some)
                    if cover is None:
                        break
                    open_ *= 1.0 - cover.sample(through_points, some)
                found[mine] += psf.light * (together.sample(through_points, some) - means)
            return found

        return sample

    return device.upload(np.maximum(converged_mosaic(frame, optics.accuracy, of_band, progress), np.float32(0.0)))


def _starts(optics: OpticsPlan, channel: int) -> Callable[[np.ndarray], np.ndarray]:
    """Function from points of the unit square (..., 2) to where rays start, x and y from a photosite's corner [photosites].

    As many start in each sample as the kernel in focus has weight there, evenly; weights below 0 count as none.
    """
    assert optics.psf is not None
    in_focus = optics.psf.of_one_radius(0.0)
    table, over = gather_table(in_focus.kernel(0, channel, True, 0, 0)), in_focus.over
    first = max(len(table) // (2 * over) - NEAR_PX, 0) * over
    weights = np.maximum(table[first : len(table) - first, first : len(table) - first], 0.0)
    borders = (np.arange(len(weights) + 1) - (len(weights) - over) // 2) / over
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
