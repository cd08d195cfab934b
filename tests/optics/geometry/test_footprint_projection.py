"""Means of a scene's light over several squares around a sample, against points counted in float64."""

import itertools

import numpy as np
import pytest

from simulator.device import open_device
from simulator.optics.geometry.footprint import Footprint
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project, project_planes
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

POINTS = 400  # across a square
WIDTH, HEIGHT = 50, 40  # of the scene [px]
WINDOW = Window(3, 5, 37, 31)  # which sees beyond the scene's grid on two sides
BLURS = 40  # parts of the square over which all is averaged once more
FOOTPRINTS = [
    Footprint(),
    Footprint(0.7, 0.4),
    Footprint(1.0, 0.0, 0.28, 0.2),
    Footprint(0.8, 2.3, 0.28, 0.12),
    Footprint(1.0, 0.0, 0.13, 0.6, 0.4),
]


def means(
    footprint: Footprint, scale: float, offset_px: float, over: int, first: int, count: int, pixels: int, is_tent: bool
) -> np.ndarray:
    """Share of each pixel in samples along an axis, by points of the squares, (count, pixels)."""
    inside = footprint.side_px * ((np.arange(POINTS) + 0.5) / POINTS - 0.5)
    found, blurs = np.zeros((count, pixels)), footprint.blur_px * ((np.arange(BLURS) + 0.5) / BLURS - 0.5)
    for (place, share), blur in itertools.product(footprint.places, blurs if footprint.blur_px else [0.0]):
        middles = (first + np.arange(count)[:, None] + 0.5) / over
        at = offset_px + scale * (middles + place + blur + inside) - 0.5
        at = at if is_tent else np.round(at)
        lines = (np.interp(at, np.arange(pixels), one).mean(axis=1) for one in np.eye(pixels))
        found += share * np.stack(list(lines), axis=1) / (BLURS if footprint.blur_px else 1)
    return found


@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize(
    ("scale", "is_tent"), [(0.23, True), (0.462, True), (0.93, True), (0.7, False), (1.4, False), (3.3, False)]
)
def test_samples_are_means_over_their_footprint(footprint, scale, is_tent):
    """A mosaic of two colours and the planes of both; a part of it has its bits, and even light stays even."""
    device, cfa = open_device(), Cfa.named("RGGB")
    light = np.random.default_rng(1).random((3, HEIGHT, WIDTH)).astype(np.float32)
    nearest, most = not is_tent and scale < 1.0, 2e-5 if is_tent else 5e-3  # points count squares less exactly
    projection = Projection(scale, -1.3, 9.2, WIDTH, HEIGHT, 1, nearest, is_bilinear=is_tent, footprints=(footprint,))

    def truth_of(over: int) -> np.ndarray:
        down = means(footprint, scale, 9.2, over, over * WINDOW.y, over * WINDOW.height, HEIGHT, is_tent)
        across = means(footprint, scale, -1.3, over, over * WINDOW.x, over * WINDOW.width, WIDTH, is_tent)
        return down @ light @ across.T

    truth = truth_of(1)
    planes = device.upload(light)

    def mosaic(window: Window, light=planes) -> np.ndarray:
        found = project(device, projection, cfa, window, light)
        return device.download(found, (window.height, window.width), np.float32)

    found, own = mosaic(WINDOW), np.array(cfa.block(WINDOW.x, WINDOW.y))
    rows, columns = np.mgrid[: WINDOW.height, : WINDOW.width]
    assert np.abs(found - truth[own[rows % 2, columns % 2], rows, columns]).max() < most
    assert np.array_equal(mosaic(Window(10, 12, 9, 8)), found[7:15, 7:16])

    def samples(over: int) -> np.ndarray:
        layout = InterleavedColumns.holding(over, over * WINDOW.height, over * WINDOW.width)
        sampled = device.empty(layout.shape(3), np.float32)
        project_planes(device, projection, planes, 3, sampled, 0, layout, (WINDOW.x, WINDOW.y))
        return layout.decode(device.download(sampled, layout.shape(3), np.float32))[..., : over * WINDOW.width]

    every = samples(1)
    assert np.array_equal(every[own[rows % 2, columns % 2], rows, columns], found) and np.abs(every - truth).max() < most
    assert np.abs(samples(3) - truth_of(3)).max() < most
    assert np.ptp(mosaic(WINDOW, device.upload(np.full((3, HEIGHT, WIDTH), 0.7, np.float32)))) == 0.0


@pytest.mark.parametrize("is_tent", [False, True])
def test_squares_beside_take_what_kernels_give_back(is_tent):
    """The transfer function of the squares beside and the one more, and of what a pixel brings."""
    footprint, cycles = Footprint(0.8, 0.6, 0.28, 0.2, 0.45), np.linspace(0.0, 0.5, 9)
    away = np.arange(-6.0, 6.0, 1e-3)
    spread = footprint.of_pixel(away, 1.7, is_tent=is_tent) / 1.7
    found = np.cos(2.0 * np.pi * np.outer(cycles, away)) @ spread * 1e-3
    aperture = np.cos(0.6 * np.pi * cycles) * np.sinc(0.8 * cycles)
    assert np.abs(found - np.sinc(1.7 * cycles) ** (1 + is_tent) * aperture * footprint.beside_transfer(cycles)).max() < 1e-5


def test_each_channel_has_a_footprint_of_its_own():
    """Planes and a mosaic of three, bit by bit as of each by itself."""
    device, cfa, over = open_device(), Cfa.named("RGGB"), 3
    planes = device.upload(np.random.default_rng(1).random((3, HEIGHT, WIDTH)).astype(np.float32))
    own = tuple(Footprint(1.0, 0.0, beside_px, 0.5, 0.3) for beside_px in (0.4, 0.1, 0.25))
    layout = InterleavedColumns.holding(over, over * WINDOW.height, over * WINDOW.width)

    def taken(*footprints: Footprint) -> tuple[np.ndarray, np.ndarray]:
        projection = Projection(1.4, -1.3, 9.2, WIDTH, HEIGHT, 2, False, footprints=footprints)
        sampled = device.empty(layout.shape(3), np.float32)
        project_planes(device, projection, planes, 3, sampled, 0, layout, (WINDOW.x, WINDOW.y))
        mosaic = project(device, projection, cfa, WINDOW, planes)
        return device.download(sampled, layout.shape(3), np.float32), device.download(
            mosaic, (WINDOW.height, WINDOW.width), np.float32
        )

    (samples, mosaic), alone = taken(*own), [taken(one) for one in own]
    colors = np.array(cfa.block(WINDOW.x, WINDOW.y))[np.arange(WINDOW.height)[:, None] % 2, np.arange(WINDOW.width) % 2]
    for channel, (of_all, seen) in enumerate(alone):
        assert np.allclose(samples[channel], of_all[channel], rtol=0.0, atol=3e-7)  # others reach farther
        assert np.allclose(mosaic[colors == channel], seen[colors == channel], rtol=0.0, atol=3e-7)
