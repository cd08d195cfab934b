"""Means of bilinear light over several squares around a photosite, against points counted in float64."""

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
FOOTPRINTS = [Footprint(), Footprint(0.7, 0.4), Footprint(1.0, 0.0, 0.28, 0.2), Footprint(0.8, 2.3, 0.28, 0.12)]


def means(footprint: Footprint, scale: float, offset_px: float, first: int, count: int, pixels: int) -> np.ndarray:
    """Share of each pixel in photosites along an axis, by points of the squares, (count, pixels)."""
    inside = footprint.side_px * ((np.arange(POINTS) + 0.5) / POINTS - 0.5)
    found = np.zeros((count, pixels))
    for place, share in footprint.places:
        at = offset_px + scale * (first + np.arange(count)[:, None] + 0.5 + place + inside) - 0.5
        lines = (np.interp(at, np.arange(pixels), one).mean(axis=1) for one in np.eye(pixels))
        found += share * np.stack(list(lines), axis=1)
    return found


@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize("scale", [0.23, 0.462, 0.93])
def test_photosites_are_means_over_their_footprint(footprint, scale):
    """A mosaic of two colours and the planes of both; a part of it has its bits, and even light stays even."""
    device, cfa = open_device(), Cfa.named("RGGB")
    light = np.random.default_rng(1).random((3, HEIGHT, WIDTH)).astype(np.float32)
    projection = Projection(scale, -1.3, 9.2, WIDTH, HEIGHT, 1, False, is_bilinear=True, footprint=footprint)
    down = means(footprint, scale, 9.2, WINDOW.y, WINDOW.height, HEIGHT)
    across = means(footprint, scale, -1.3, WINDOW.x, WINDOW.width, WIDTH)
    truth = down @ light @ across.T
    planes = device.upload(light)

    def mosaic(window: Window, light=planes) -> np.ndarray:
        found = project(device, projection, cfa, window, light)
        return device.download(found, (window.height, window.width), np.float32)

    found, own = mosaic(WINDOW), np.array(cfa.block(WINDOW.x, WINDOW.y))
    rows, columns = np.mgrid[: WINDOW.height, : WINDOW.width]
    assert np.abs(found - truth[own[rows % 2, columns % 2], rows, columns]).max() < 2e-5
    assert np.array_equal(mosaic(Window(10, 12, 9, 8)), found[7:15, 7:16])
    layout = InterleavedColumns.holding(1, WINDOW.height, WINDOW.width)
    sampled = device.empty(layout.shape(3), np.float32)
    project_planes(device, projection, planes, 3, sampled, 0, layout, (WINDOW.x, WINDOW.y))
    every = layout.decode(device.download(sampled, layout.shape(3), np.float32))[..., : WINDOW.width]
    assert np.array_equal(every[own[rows % 2, columns % 2], rows, columns], found) and np.abs(every - truth).max() < 2e-5
    assert np.ptp(mosaic(WINDOW, device.upload(np.full((3, HEIGHT, WIDTH), 0.7, np.float32)))) == 0.0


def test_squares_beside_take_what_kernels_give_back():
    """The transfer function of the squares beside, and of what a pixel brings."""
    footprint, cycles = Footprint(0.8, 0.6, 0.28, 0.2), np.linspace(0.0, 0.5, 9)
    away = np.arange(-6.0, 6.0, 1e-3)
    spread = footprint.of_pixel(away, 1.7) / 1.7
    found = np.cos(2.0 * np.pi * np.outer(cycles, away)) @ spread * 1e-3
    aperture = np.cos(0.6 * np.pi * cycles) * np.sinc(0.8 * cycles)
    assert np.abs(found - np.sinc(1.7 * cycles) ** 2 * aperture * footprint.beside_transfer(cycles)).max() < 1e-5
