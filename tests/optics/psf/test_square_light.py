"""Pixels of light behind a filter and photosites: along one axis against sums over their parts, and in frames of a lens."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.green_frames import EXPOSURE, lens
from helpers.moving_frame import moving_light
from helpers.pupil_truth import through_pupil
from helpers.scene_builders import band_scene

from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.square_light import line_weights, shared_length
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera_sections import Window

PARTS, PITCH_UM = 20000, 5.0
SIZE, UNEVEN, BEYOND_PX = (72, 96), (40, 80), 60  # photosites, and how far the truth continues the border
AWAY_PX = np.linspace(-3.1, 3.1, 23)


@pytest.mark.parametrize("is_tent", [False, True])
@pytest.mark.parametrize(("fill_factor", "low_pass_um", "width_px"), [(1.0, 0.0, 1.0), (0.5, 3.0, 0.4), (0.81, 4.0, 1.6)])
def test_photosites_share_a_pixel_by_length(fill_factor, low_pass_um, width_px, is_tent):
    x = (np.arange(PARTS) + 0.5) / PARTS * 8.0 - 4.0
    light = np.maximum(1.0 - np.abs(x / width_px), 0.0) if is_tent else (np.abs(x) < 0.5 * width_px).astype(float)
    expected = np.zeros(len(AWAY_PX))
    for spot in (-0.5, 0.5):
        middle = AWAY_PX + spot * low_pass_um / PITCH_UM
        open_ = np.abs(x - middle[:, None]) < 0.5 * math.sqrt(fill_factor)
        expected += 0.5 * (open_ * light).sum(axis=1) * 8.0 / PARTS / math.sqrt(fill_factor)
    found = shared_length(Sampling(fill_factor, low_pass_um), PITCH_UM, AWAY_PX, width_px, is_tent=is_tent)
    assert found == pytest.approx(expected, abs=2e-3)


def test_a_smooth_spot_spreads_the_pixel_that_photosites_share():
    """Cells of a Gaussian of 0.6 photosites, which pass no more than 0.001 beyond the cells' own frequencies."""
    per_photosite, count, sampling = 5, 35, Sampling(0.64, 3.0)
    edges = (np.arange(count + 1) - 0.5 * count) / per_photosite
    cells = np.diff([0.5 * math.erf(edge / (0.6 * math.sqrt(2.0))) for edge in edges])
    fine = np.linspace(-3.5, 3.5, 7001)
    spread = np.exp(-0.5 * (fine / 0.6) ** 2)
    spread /= spread.sum()
    expected = [spread @ shared_length(sampling, PITCH_UM, away - fine, 0.8, is_tent=False) for away in AWAY_PX]
    found = line_weights(sampling, PITCH_UM, AWAY_PX, 0.8, (count, per_photosite)) @ cells
    assert found == pytest.approx(np.array(expected), abs=1e-5)


def errors_of(shot: Shot, planes: np.ndarray, parts: int, pixel: int) -> tuple[np.ndarray, Plan]:
    """Errors of photosites [sigma] of a shot of these squares at 2,000 e-, against its pupil, and the plan.

    parts: of a photosite; pixel: of a pixel of the scene.
    """
    brightest_e = plan(shot).optics.accuracy.electrons
    shot = dataclasses.replace(shot, exposure=dataclasses.replace(EXPOSURE, time_s=EXPOSURE.time_s * 2000.0 / brightest_e))
    planned = plan(shot)
    optics = planned.optics
    per_light, read_e = optics.accuracy.electrons_per_radiance * optics.weights.max(), optics.accuracy.read_noise_e
    truth = through_pupil(np.kron(planes, np.ones((pixel, pixel))), optics.psf, BEYOND_PX, parts)
    return per_light * np.abs(moving_light(planned) - truth) / np.sqrt(per_light * truth + read_e**2), planned


def random_squares(counts: tuple[int, int], side: int = 1) -> np.ndarray:
    """Squares of so many pixels, 20:1."""
    return np.kron(0.05 + 0.95 * (np.random.default_rng(2).random(counts) < 0.5), np.ones((side, side)))


@pytest.mark.parametrize("f_number", [2.8, 8.0])
@pytest.mark.parametrize(
    ("scale", "side", "interpolation"),
    [(0.5, 1, "nearest"), (1.0, 1, "nearest"), (1.5, 4, "bilinear"), (2.0, 3, "bilinear"), (4.0, 8, "bilinear")],
)
def test_squares_behind_a_pupil_are_as_exact_as_is_told(scale, side, interpolation, f_number):
    """Random squares; kernels that end at half a cycle of their samples leave 0.5 to 10 sigma."""
    planes, parts = random_squares([round(size * scale / side) for size in SIZE], side), 9 if scale == 1.5 else 8
    through = dataclasses.replace(lens(f_number), diffraction=True)
    shot = Shot(band_scene(planes, math.inf, interpolation=interpolation), through, EXPOSURE, green_camera(*SIZE[::-1]))
    error, planned = errors_of(shot, planes, parts, round(parts / scale))
    assert np.quantile(error, 0.99) < planned.error_budget.predicted_sigma < 0.1


@pytest.mark.parametrize(
    ("parts", "pixel", "f_number", "aperture"),
    [
        *((*sides, f_number, {}) for sides in [(10, 8), (14, 10), (15, 6), (12, 2), (14, 20)] for f_number in (2.8, 8.0)),
        *((14, 10, f_number, {}) for f_number in (1.8, 5.6, 16.0)),
        *((14, 10, 4.0, aperture) for aperture in ({"fill_factor": 0.5}, {"low_pass_um": 3.0})),
    ],
)
def test_squares_that_no_samples_divide_are_as_exact_as_is_told(parts, pixel, f_number, aperture):
    """Samples that are means over their own part of a photosite mix them: 0.3 to 2 sigma, of which 0.5 to 2 were told."""
    scale = parts / pixel
    through, camera = dataclasses.replace(lens(f_number), diffraction=True), green_camera(*UNEVEN[::-1])
    planes = random_squares([round(size * scale) for size in UNEVEN])
    scene = band_scene(planes, math.inf, interpolation="nearest" if scale < 1.0 else "bilinear")
    shot = Shot(scene, through, EXPOSURE, dataclasses.replace(camera, **aperture))
    error, planned = errors_of(shot, planes, parts, pixel)
    assert np.quantile(error, 0.999) < min(planned.error_budget.predicted_sigma, 0.1)
    assert planned.error_budget.predicted_sigma < 0.2


@pytest.mark.parametrize(
    ("size", "scale", "low_pass_um", "tolerance"),
    [(UNEVEN, 1.4, 0.0, 0.1), ((320, 96), 5.3, 0.0, 0.0), ((320, 96), 2.6, 20.0, 0.0)],  # the reference path transforms
)
def test_a_window_of_squares_has_the_bits_of_the_frame(size, scale, low_pass_um, tolerance):
    through, camera = dataclasses.replace(lens(2.8), diffraction=True), green_camera(*size[::-1], low_pass_um=low_pass_um)
    scene = band_scene(random_squares([round(side * scale) for side in size]), math.inf)
    shot = Shot(scene, through, EXPOSURE, camera, tolerance=tolerance)
    assert plan(shot).optics.psf.footprints
    whole, top = moving_light(plan(shot)), size[0] // 2 - 20
    window = dataclasses.replace(camera, window=Window(10, top, 40, 20))
    part = moving_light(plan(dataclasses.replace(shot, camera=window)))
    assert np.array_equal(part, whole[top : top + 20, 10:50])


@pytest.mark.parametrize("f_number", [2.8, pytest.param(8.0, marks=pytest.mark.slow)])
def test_each_colour_of_squares_is_as_exact_as_is_told(f_number):
    """Footprints that all colours share leave ten times as much at f/2.8: 0.3 sigma are told then."""
    parts, pixel = 14, 10
    light = np.stack([random_squares([56, 112]), random_squares([56, 112])[::-1], random_squares([56, 112])[:, ::-1]], axis=-1)
    through = dataclasses.replace(lens(f_number), diffraction=True)
    shot = Shot(band_scene(light, math.inf), through, EXPOSURE, small_camera(*UNEVEN[::-1], "RGGB"))
    brightest_e = plan(shot).optics.accuracy.electrons
    shot = dataclasses.replace(shot, exposure=dataclasses.replace(EXPOSURE, time_s=EXPOSURE.time_s * 2000.0 / brightest_e))
    planned, found = plan(shot), moving_light(plan(shot))
    optics, colors = planned.optics, np.tile(np.array([[0, 1], [1, 2]]), (UNEVEN[0] // 2, UNEVEN[1] // 2))
    assert len(optics.psf.footprints) == 3
    per_radiance, read_e = optics.accuracy.electrons_per_radiance, optics.accuracy.read_noise_e
    found = per_radiance * optics.weights.max() * found
    for channel, wavelengths_nm in enumerate(optics.psf.lens_psf.wavelengths_nm):
        own = dataclasses.replace(optics.psf.lens_psf, wavelengths_nm=(wavelengths_nm,))
        planes = np.kron(optics.scene.planes.astype(np.float64) @ optics.weights[:, channel], np.ones((pixel, pixel)))
        truth = per_radiance * through_pupil(planes, dataclasses.replace(optics.psf, lens_psf=own), BEYOND_PX, parts)
        error = (np.abs(found - truth) / np.sqrt(truth + read_e**2))[colors == channel]
        assert np.quantile(error, 0.999) < min(planned.error_budget.predicted_sigma, 0.1)
    assert planned.error_budget.predicted_sigma < 0.2
