"""Circles far larger than the Airy disk: against the transfer function of the defocused pupil in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, PITCH_UM
from helpers.moving_frame import moving_light
from helpers.pupil_truth import through_pupil
from helpers.scene_builders import band_scene

from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.psf.psf_errors import FAR_CIRCLES
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot

SIZE, BEYOND_PX = (128, 160), 200  # photosites, and how far the truth continues the border


def distance_m(through: ThinLens, radius_px: float) -> float:
    per_dioptre = 0.5 * through.pupil_diameter_mm * through.image_distance_mm
    return 1.0 / (1.0 / through.focus_distance_m - radius_px * PITCH_UM / per_dioptre)


def planned_shot(f_number: float, radii_px: list[float]) -> tuple[Plan, np.ndarray]:
    """Plan of 2,000 e- of squares of 5 photosites, 20:1, which stand at columns of distances; and their light."""
    through = ThinLens(50.0, f_number, 2.0, cos4=False, diffraction=True)
    few = np.random.default_rng(4).random((SIZE[0] // 4, SIZE[1] // 5)) < 0.5
    planes = 0.05 + 0.95 * np.kron(few, np.ones((4, 5)))
    depth_m = np.repeat([distance_m(through, radius) for radius in radii_px], SIZE[1] // len(radii_px))
    depth = np.broadcast_to(depth_m, SIZE).astype(np.float32) if len(radii_px) > 1 else float(depth_m[0])
    shot = Shot(band_scene(planes, depth), through, EXPOSURE, green_camera(*SIZE[::-1]))
    time_s = EXPOSURE.time_s * 2000.0 / plan(shot).optics.accuracy.electrons
    return plan(dataclasses.replace(shot, exposure=dataclasses.replace(EXPOSURE, time_s=time_s))), planes


def error_sigma(planned: Plan, planes: np.ndarray, radius_px: float) -> np.ndarray:
    """Error of a frame whose circles have one radius [standard deviations of each photosite's noise]."""
    optics = planned.optics
    per_light, read_e = optics.accuracy.electrons_per_radiance * optics.weights.max(), optics.accuracy.read_noise_e
    truth = through_pupil(planes, optics.psf, BEYOND_PX, radius_px=radius_px)
    return per_light * np.abs(moving_light(planned) - truth) / np.sqrt(per_light * truth + read_e**2)


@pytest.mark.parametrize(("f_number", "radius_px"), [(2.8, 9.0), (2.8, -30.0), (8.0, 20.0)])
def test_a_wall_far_out_of_focus_is_that_of_the_pupil(f_number, radius_px):
    """The aperture's image, convolved with the kernel in focus, left 1.5 to 3 sigma."""
    planned, planes = planned_shot(f_number, [radius_px])
    assert planned.optics.psf.by_distance and planned.optics.far_error == 0.0
    assert np.quantile(error_sigma(planned, planes, radius_px), 0.99) < planned.error_budget.predicted_sigma < 0.15


@pytest.mark.parametrize(("f_number", "radius_px"), [(2.8, 9.0), (4.0, 14.0)])
def test_what_far_circles_of_one_picture_leave_is_told(f_number, radius_px):
    """A wall of which half is out of focus, away from the step."""
    planned, planes = planned_shot(f_number, [0.0, radius_px])
    told = next(term.sigma for term in planned.error_budget.terms if term.cause == FAR_CIRCLES)
    reach = math.ceil(3.0 * radius_px)
    found = np.quantile(error_sigma(planned, planes, radius_px)[:, SIZE[1] // 2 + reach :], 0.999)
    assert 0.3 < found < planned.error_budget.predicted_sigma and 0.5 * told < found < 1.3 * told
