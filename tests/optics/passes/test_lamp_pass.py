"""Lamps behind a point spread function, against sums over frequencies in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.green_frames import EXPOSURE, GREEN_UM, PITCH_UM, lens
from helpers.kernels_alone import without_wings
from helpers.scene_builders import band_scene
from helpers.square_truth import light_of_squares, transfer_of_cells
from helpers.wave_optics import pupil_transfer

from simulator.device import open_device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.optics_planning import plan_optics
from simulator.optics.psf.kernel_split import Core
from simulator.pipeline.error_budget import error_budget
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window

SIDE, MARGIN = 64, 48  # photosites
ELECTRONS = 2e4  # of light 1


def lamps(dark: float = 0.0, per_photosite: float = 1.0, count: int = 60, light: float = 1000.0) -> np.ndarray:
    """Single pixels of a lot of light in a dark scene, one of them in its corner and one in its border."""
    rng, side = np.random.default_rng(5), round(SIDE * per_photosite)
    planes = np.full((side, side), dark)
    planes[tuple(rng.integers(0, side, (2, count)))] = light
    planes[0, 0] = planes[-1, side // 2] = light
    return planes


def planned_shot(planes: np.ndarray, through, camera, interpolation: str = "nearest") -> Plan:
    """A shot in which light 1 is ELECTRONS, by its kernels alone."""
    return measure(without_wings(whole_shot(planes, through, camera, interpolation)), open_device())


def whole_shot(planes: np.ndarray, through, camera, interpolation: str = "nearest") -> Plan:
    """The same with light from beyond the kernels."""
    shot = Shot(band_scene(planes, math.inf, interpolation=interpolation), through, EXPOSURE, camera)
    unit = plan(shot).optics
    each_e = float(unit.accuracy.electrons_per_radiance * unit.weights.sum())
    exposure = dataclasses.replace(EXPOSURE, time_s=EXPOSURE.time_s * ELECTRONS / each_e)
    return measure(plan(dataclasses.replace(shot, exposure=exposure)), open_device())


def electrons_of(planned: Plan) -> np.ndarray:
    window, device = planned.optics.window, open_device()
    light = device.download(expose(planned, device), (window.height, window.width), np.float32).astype(np.float64)
    return ELECTRONS * light / float(planned.optics.weights.sum())


def worst_sigma(found: np.ndarray, truth: np.ndarray) -> float:
    """Error that 99.9 % of the photosites keep, in their own noise; below 1 e- that counts as 1 e-."""
    return float(np.quantile(np.abs(found - truth) / np.sqrt(np.maximum(truth, 1.0)), 0.999))


def truth_of(planned: Plan, planes: np.ndarray) -> np.ndarray:
    """Electrons behind the planned kernel's cells, the filter and the aperture."""
    psf = planned.optics.psf
    assert psf is not None
    cells, per_photosite = psf.point_cells(0, 0, 0)
    of_lens = transfer_of_cells(cells, per_photosite)

    def transfer(right: np.ndarray, down: np.ndarray) -> np.ndarray:
        sampled = psf.sampling.transfer(right / PITCH_UM, PITCH_UM) * psf.sampling.transfer(down / PITCH_UM, PITCH_UM)
        return sampled * of_lens(right, down)

    return ELECTRONS * light_of_squares(planes, (SIDE, SIDE), transfer, MARGIN, 0.5 * per_photosite)


@pytest.mark.parametrize(
    ("f_number", "settings", "scale", "dark"),
    [
        (8.0, {}, 1.0, 0.0),
        (5.6, {"low_pass_um": 4.0}, 1.0, 1e-3),
        pytest.param(8.0, {"fill_factor": 0.6}, 3.0, 0.0, marks=pytest.mark.slow),
        (8.0, {}, 1.375, 0.0),
        (8.0, {}, 0.5, 0.0),
    ],
)
def test_lamps_in_the_dark_are_squares_of_light(f_number, settings, scale, dark):
    """At any place among the photosites: those of 1.375 pixels each are read between tabulated places."""
    planes = lamps(dark, scale)
    planned = planned_shot(planes, lens(f_number, diffraction=True), green_camera(SIDE, SIDE, **settings))
    assert planned.optics.lamps is not None
    assert error_budget(planned.optics).predicted_sigma <= planned.optics.tolerance
    assert worst_sigma(electrons_of(planned), truth_of(planned, planes)) <= planned.optics.tolerance


def test_a_scene_full_of_lamps_has_kernels_of_squares():
    """As where lamps are too many to be drawn one by one; by whole kernels."""
    planes = np.where(np.random.default_rng(1).random((SIDE, SIDE)) < 0.5, 100.0, 0.0)
    planes[:, SIDE // 8 :] = 0.0
    planned = planned_shot(planes, lens(8.0, diffraction=True), green_camera(SIDE, SIDE))
    psf = planned.optics.psf
    whole = psf.with_core(Core(psf.reach_px, psf.reach_px, 0, 0.0), psf.seen)
    optics = dataclasses.replace(planned.optics, lamps=None, psf=whole)
    undrawn = measure(without_wings(dataclasses.replace(planned, optics=optics)), open_device())
    assert worst_sigma(electrons_of(undrawn), truth_of(planned, planes)) < planned.optics.tolerance


def test_lamps_that_are_not_drawn_state_their_error():
    """Between photosites, where samples of light mix pixels."""
    planes, through = lamps(per_photosite=1.375), lens(8.0, diffraction=True)
    planned = planned_shot(planes, through, green_camera(SIDE, SIDE))
    optics = plan_optics(planned.optics.scene, through, planned.sensor, planned.optics.tolerance, is_at_rest=False)
    budget = error_budget(optics)
    stated = next(term.sigma for term in budget.terms if "lamps" in term.cause)
    undrawn = measure(without_wings(dataclasses.replace(planned, optics=optics)), open_device())
    assert budget.tolerance < worst_sigma(electrons_of(undrawn), truth_of(planned, planes)) <= stated
    assert budget.is_clamped


def test_a_lamp_has_the_closed_form_of_the_pupil():
    """To 0.002 of its brightest photosite, with light that falls beyond the kernel."""
    planes = np.zeros((SIDE, SIDE))
    planes[SIDE // 2, SIDE // 2] = 1000.0
    planned = whole_shot(planes, lens(8.0, diffraction=True), green_camera(SIDE, SIDE))

    def transfer(right: np.ndarray, down: np.ndarray) -> np.ndarray:
        cycles_per_um = np.hypot(right, down) / PITCH_UM
        return np.vectorize(pupil_transfer)(cycles_per_um, 8.0) * np.sinc(right) * np.sinc(down)

    finest = PITCH_UM / (GREEN_UM * 8.0)
    truth = ELECTRONS * light_of_squares(planes, (SIDE, SIDE), transfer, 0, finest)
    assert np.abs(electrons_of(planned) - truth).max() < 0.002 * truth.max()


def test_lamps_of_a_window_have_the_bits_of_the_whole_frame():
    """In each colour, one of a light by itself and all of them."""
    through = lens(8.0, diffraction=True)
    planes = np.random.default_rng(2).random((60, 100, 3)) * 0.1
    planes[[3, 20, 31, 40], [0, 50, 51, 99]] = 1e4 * np.array(
        [[1.0, 0.5, 0.1], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.2, 0.0, 1.0]]
    )
    scene, camera = band_scene(planes, math.inf), small_camera(150, 90, "GRBG")
    shot = Shot(scene, through, Exposure(1e-4), camera)
    assert plan(shot).optics.lamps is not None
    whole = simulate(shot).mean_electrons
    for x, y, width, height in ((0, 0, 60, 31), (71, 37, 30, 51)):
        window = dataclasses.replace(camera, window=Window(x, y, width, height))
        crop = simulate(dataclasses.replace(shot, camera=window)).mean_electrons
        assert np.array_equal(crop, whole[y : y + height, x : x + width])


def test_what_moves_draws_no_lamps():
    shot = Shot(band_scene(lamps(), math.inf), lens(8.0, diffraction=True), EXPOSURE, green_camera(SIDE, SIDE))
    assert plan(shot).optics.lamps is not None
    moving = plan(dataclasses.replace(shot, motion=Motion(camera=SteadyMotion(pan_deg_per_s=20.0)))).optics
    assert moving.motion is not None and moving.lamps is None
