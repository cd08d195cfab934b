"""Pixels of light behind a filter and photosites: along one axis against sums over their parts, and in frames of a lens."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, lens
from helpers.moving_frame import moving_light
from helpers.pupil_truth import through_pupil
from helpers.scene_builders import band_scene

from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.square_light import line_weights, shared_length
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

PARTS, PITCH_UM = 20000, 5.0
SIZE, BEYOND_PX = (72, 96), 100  # photosites, and how far the truth continues the border
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


@pytest.mark.parametrize("f_number", [2.8, 8.0])
@pytest.mark.parametrize(
    ("scale", "side", "interpolation"),
    [(0.5, 1, "nearest"), (1.0, 1, "nearest"), (1.5, 4, "bilinear"), (2.0, 3, "bilinear"), (4.0, 8, "bilinear")],
)
def test_squares_behind_a_pupil_are_as_exact_as_is_told(scale, side, interpolation, f_number):
    """Random squares, 20:1 at 2,000 e-; kernels that end at half a cycle of their samples leave 0.5 to 10 sigma."""
    counts = [round(size * scale / side) for size in SIZE]
    planes = np.kron(0.05 + 0.95 * (np.random.default_rng(2).random(counts) < 0.5), np.ones((side, side)))
    through = dataclasses.replace(lens(f_number), diffraction=True)
    shot = Shot(band_scene(planes, math.inf, interpolation=interpolation), through, EXPOSURE, green_camera(*SIZE[::-1]))
    brightest_e = plan(shot).optics.accuracy.electrons
    shot = dataclasses.replace(shot, exposure=dataclasses.replace(EXPOSURE, time_s=EXPOSURE.time_s * 2000.0 / brightest_e))
    planned = plan(shot)
    optics, parts = planned.optics, 9 if scale == 1.5 else 8
    per_light, read_e = optics.accuracy.electrons_per_radiance * optics.weights.max(), optics.accuracy.read_noise_e
    truth = through_pupil(np.kron(planes, np.ones(2 * [round(parts / scale)])), optics.psf, BEYOND_PX, parts)
    error = per_light * np.abs(moving_light(planned) - truth) / np.sqrt(per_light * truth + read_e**2)
    assert np.quantile(error, 0.99) < planned.error_budget.predicted_sigma < 0.1
