"""Low-pass filter and open area of photosites over the even squares of a fine scene, against areas counted in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_frame import LENS
from helpers.light_through_filter import through_filter

from simulator.sensor.camera.camera import Window

SHAPE = (30, 40)  # photosites
INNER = (slice(4, -4), slice(4, -4))


@pytest.mark.parametrize("scale", [1, 2, 3, 4])
@pytest.mark.parametrize(("fill_factor", "spots_px"), [(1.0, 0.5), (1.0, 0.7), (0.64, 0.6)])
def test_a_low_pass_filter_over_squares_is_exact(scale, fill_factor, spots_px):
    """Random pixels, dark to bright: no photosite is off by more than single precision."""
    pixels = 0.05 + 0.95 * (np.random.default_rng(scale).random((scale * SHAPE[0], scale * SHAPE[1])) < 0.5)
    shot = fine_shot(pixels, SHAPE, 0.0, 5000.0, fill_factor)
    shot = dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, low_pass_um=5.0 * spots_px))
    found, planned = frame_radiance(shot)
    assert planned.optics.sees_spots and planned.error_budget.predicted_sigma == 0.0
    truth = through_filter(pixels, SHAPE, spots_px, math.sqrt(fill_factor))
    assert np.abs(found - truth)[INNER].max() < 5e-5  # thirds of a photosite are places in single precision


@pytest.mark.parametrize(("fill_factor", "spots_px"), [(1.0, 0.7), (1.0, 0.967), (0.64, 0.45)])
def test_a_low_pass_filter_over_a_sharp_coarse_scene_is_exact(fill_factor, spots_px):
    """Pixels of two photosites, light and dark, linear in between: whole photosites for samples were off by a sigma."""
    electrons, side = 2000.0, math.sqrt(fill_factor)
    pixels = 0.3 + 0.7 * (np.random.default_rng(7).random((SHAPE[0] // 2, SHAPE[1] // 2)) < 0.5)
    shot = fine_shot(pixels, SHAPE, 0.0, electrons, fill_factor, 0.3)
    shot = dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, low_pass_um=5.0 * spots_px))
    found, planned = frame_radiance(shot)

    def line(photosites: int, count: int) -> np.ndarray:
        inside = side * ((np.arange(64) + 0.5) / 64 - 0.5)
        spots = np.concatenate([inside - 0.5 * spots_px, inside + 0.5 * spots_px])
        places = 0.5 * (np.arange(photosites)[:, None] + 0.5 + spots) - 0.5  # 0: the middle of the first pixel
        return np.stack([np.interp(places, np.arange(count), one).mean(axis=1) for one in np.eye(count)], axis=1)

    truth = line(SHAPE[0], pixels.shape[0]) @ pixels @ line(SHAPE[1], pixels.shape[1]).T
    sigma = np.abs(found - truth)[INNER] * math.sqrt(electrons) / np.sqrt(truth[INNER])
    assert planned.optics.psf is None and planned.error_budget.predicted_sigma == 0.0
    assert sigma.max() < 2e-3  # of 64 points across the open area, which the truth is a mean of


@pytest.mark.parametrize(("radius_px", "spots_px"), [(0.5, 0.5), (1.0, 0.6), (2.0, 0.6), (4.0, 0.5)])
def test_each_spot_of_a_filter_sees_a_fine_scene_out_of_focus_by_itself(radius_px, spots_px):
    """Squares of 1.5 photosites: a kernel of the filter, behind the blur, would see the light of whole photosites."""
    scene = np.kron(np.random.default_rng(3).random((20, 27)) < 0.5, np.ones((3, 3)))[: 2 * SHAPE[0], : 2 * SHAPE[1]]
    pixels = 0.05 + 0.95 * scene
    shot = fine_shot(pixels, SHAPE, radius_px, 2000.0, lens=LENS)
    shot = dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, low_pass_um=5.0 * spots_px))
    found, planned = frame_radiance(shot)
    truth = through_filter(pixels, SHAPE, spots_px, 1.0, radius_px)
    inner = (slice(8, -8), slice(8, -8))
    sigma = np.abs(found - truth)[inner] * math.sqrt(2000.0) / np.sqrt(truth[inner])
    assert planned.optics.psf is None and planned.optics.sees_spots
    assert np.quantile(sigma, 0.999) < 0.5  # of points of the disk, of which the truth is a mean


def test_bright_parts_behind_a_blur_are_seen_as_the_rest():
    """A twelfth of the scene is bright: kernels without ringing for what is above a limit left 3.5 sigma."""
    bright = np.kron(np.random.default_rng(3).random((20, 27)) < 0.08, np.ones((3, 3)))[: 2 * SHAPE[0], : 2 * SHAPE[1]]
    pixels, radius_px, spots_px = 0.05 + 0.95 * bright, 1.0, 0.757
    shot = fine_shot(pixels, SHAPE, radius_px, 2000.0, lens=LENS)
    shot = dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, low_pass_um=5.0 * spots_px))
    found, _ = frame_radiance(shot)
    truth, inner = through_filter(pixels, SHAPE, spots_px, 1.0, radius_px), (slice(8, -8), slice(8, -8))
    sigma = np.abs(found - truth)[inner] * math.sqrt(2000.0) / np.sqrt(truth[inner])
    assert np.quantile(sigma, 0.999) < 0.5


def test_rays_start_where_the_filter_and_the_open_area_let_them():
    """Two pixels per photosite behind a blur: photosites were off by up to 4 sigma with a kernel after the blur."""
    radius_px, spots_px, fill_factor, electrons = 0.5, 0.6, 0.64, 200.0
    pixels = np.random.default_rng(4).uniform(0.05, 1.0, (2 * SHAPE[0], 2 * SHAPE[1]))
    shot = fine_shot(pixels, SHAPE, radius_px, electrons, fill_factor, 0.0, LENS)
    camera = dataclasses.replace(shot.camera, low_pass_um=5.0 * spots_px, window=Window(10, 10, 4, 3))
    found, planned = frame_radiance(dataclasses.replace(shot, camera=camera))
    assert planned.optics.psf is None
    truth = through_filter(pixels, SHAPE, spots_px, math.sqrt(fill_factor), radius_px)[10:13, 10:14]
    sigma = np.abs(found - truth) * math.sqrt(electrons) / np.sqrt(truth)
    assert sigma.max() < 0.1  # four standard errors of the rays, and the fine grid of the truth
