"""Light that diffraction brings from beyond the kernels, against the transfer function of the pupil in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.green_frames import EXPOSURE, PITCH_UM, lens
from helpers.moving_frame import moving_light
from helpers.pupil_truth import through_pupil
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.signal import correlate2d

from simulator.optics.passes.wings import add_wings
from simulator.optics.psf.fraunhofer import ROUND, Opening
from simulator.optics.psf.wings import Wings, plan_wings
from simulator.optics.pupil.pupil import Pupil
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window

ROWS, COLUMNS, BEYOND = 200, 260, 1000  # photosites; as many around them are what the border of the scene continues


def bright_and_dark() -> np.ndarray:
    """A bright wall with a texture beside a dark one, 60:1, and a dark square in the bright."""
    rng = np.random.default_rng(2)
    planes = np.where(np.arange(COLUMNS)[None, :] < 150, 0.6, 0.01) * (0.8 + 0.4 * rng.random((ROWS, COLUMNS)))
    planes[90:110, 60:80] = 0.01
    return planes


def shot_at(
    f_number: float, planes: np.ndarray, brightest_e: float = 2000.0, depth_m: float | np.ndarray = math.inf, **settings: float
) -> Shot:
    through = dataclasses.replace(lens(f_number), diffraction=True)
    taken = Shot(band_scene(planes, depth_m), through, EXPOSURE, green_camera(COLUMNS, ROWS))
    own_e = plan(taken).optics.accuracy.electrons
    longer = dataclasses.replace(EXPOSURE, time_s=EXPOSURE.time_s * brightest_e / own_e)
    return dataclasses.replace(taken, exposure=longer, **settings)


@pytest.mark.parametrize(("f_number", "tolerance"), [(8.0, 0.1), pytest.param(16.0, 0.1, marks=pytest.mark.slow), (22.0, 0.0)])
def test_light_beside_a_bright_wall_is_that_of_the_pupil(f_number, tolerance):
    """In the dark near the wall, too: kernels alone leave several times as much."""
    planes = bright_and_dark()
    planned = plan(shot_at(f_number, planes, tolerance=tolerance))
    optics, truth = planned.optics, through_pupil(planes, planned.optics.psf, BEYOND)
    assert optics.wings is not None
    per_light = optics.accuracy.electrons_per_radiance * float(optics.weights.max())
    noise_e = np.sqrt(np.maximum(per_light * truth + optics.accuracy.read_noise_e**2, 1.0))

    def left_sigma(of: Plan) -> float:
        return float(np.quantile(per_light * np.abs(moving_light(of) - truth) / noise_e, 0.999))

    alone = left_sigma(dataclasses.replace(planned, optics=dataclasses.replace(optics, wings=None)))
    assert left_sigma(planned) < planned.error_budget.predicted_sigma
    assert left_sigma(planned) < 0.2 * alone and 0.8 * alone < optics.wings.effect_sigma < 2.2 * alone


def test_wings_begin_where_the_smallest_kernels_end():
    """Kernels a tenth of a photosite out of focus are smaller than that in focus; what lies between had no light."""
    planes, at_1_m_px = bright_and_dark(), abs(float(lens(28.4).blur_radius_um(1.0))) / PITCH_UM
    depth_m = np.full(planes.shape, at_1_m_px / 0.12, np.float32)  # of a lens that is focused at infinity
    depth_m[ROWS // 2 :] = at_1_m_px / 0.3
    planned = plan(shot_at(28.4, planes, depth_m=depth_m, tolerance=0.0))
    optics, truth = planned.optics, through_pupil(planes, planned.optics.psf, BEYOND)
    assert len(optics.psf.radii_px) > 1 and optics.psf.held_px < 0.4 * optics.psf.fit_kernel(0.0).size_px
    per_light = optics.accuracy.electrons_per_radiance * float(optics.weights.max())
    noise_e = np.sqrt(np.maximum(per_light * truth + optics.accuracy.read_noise_e**2, 1.0))
    left = np.quantile(per_light * np.abs(moving_light(planned) - truth) / noise_e, 0.999)
    assert left < planned.error_budget.predicted_sigma


def test_wings_that_do_not_show_are_left_out():
    faint, seen = (plan(shot_at(8.0, bright_and_dark(), brightest_e)) for brightest_e in (2.0, 2000.0))
    assert faint.optics.wings is None and 0.0 < faint.optics.wings_error <= 0.25 * faint.optics.accuracy.tolerance
    told, kept = (next(one for one in planned.passes if one.name == "wings of diffraction") for planned in (faint, seen))
    assert not told.kept and "all but" in told.method and kept.kept and kept.cost_ms > 0.0
    assert "wings of diffraction" in {term.effect for term in seen.error_budget.terms}


def test_a_window_has_the_bits_of_the_frame():
    shot, window = shot_at(8.0, bright_and_dark()), Window(37, 51, 70, 46)
    part = dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, window=window))
    assert plan(part).optics.wings is not None
    found, whole = (simulate(one).mean_electrons for one in (part, shot))
    np.testing.assert_array_equal(found, whole[51:97, 37:107])


@pytest.mark.parametrize("cell_px", [4, 32])
def test_the_kernel_reads_cells_bilinearly(device, cell_px):
    """Every photosite of a window, in its own colour, float64."""
    rng, window = np.random.default_rng(4), Window(3, 9, 90, 60)
    camera = small_camera(96, 72, "GRBG", window=window)
    margin, sides = 4, (-(-72 // cell_px), -(-96 // cell_px))
    light = rng.random((sides[0] + 2 * margin, sides[1] + 2 * margin, 2))
    wings = Wings(light, cell_px, rng.random((2 * margin - 1, 2 * margin - 1)), np.array([1e-3, 2e-3, 4e-3]), 1.0)
    weights, mosaic = rng.random((2, 3)).astype(np.float32), rng.random((60, 90)).astype(np.float32)
    buffer = device.upload(mosaic)
    add_wings(device, buffer, wings, weights, camera.filter.macros(window.x, window.y), window)
    y, x = np.mgrid[9:69, 3:93]
    channel = np.array([[1, 0], [2, 1]])[y % 2, x % 2]  # GRBG
    around = [correlate2d(light @ weights[:, one], wings.pattern[::-1, ::-1], mode="valid") for one in range(3)]
    spread = wings.lambda_n_px[:, None, None] * np.stack(around)
    veil = np.stack([map_coordinates(one, [(y + 0.5) / cell_px + 0.5, (x + 0.5) / cell_px + 0.5], order=1) for one in spread])
    share = 1.0 - wings.lambda_n_px * wings.pattern.sum()
    truth = share[channel] * mosaic + np.take_along_axis(veil, channel[None], axis=0)[0]
    np.testing.assert_allclose(device.download(buffer, mosaic.shape, np.float32), truth, rtol=2e-6)


def test_even_light_stays_as_it_is_and_parts_of_light_add_up():
    planned = plan(shot_at(16.0, bright_and_dark())).optics
    assert planned.wings is not None and planned.psf is not None
    even = np.full((30, 40, 2), 0.7)
    wings, _ = plan_wings(planned.psf, even, np.ones((2, 1)), planned.projection, planned.accuracy)
    assert wings is None  # what is the same everywhere shows no wings
    wings = dataclasses.replace(planned.wings, light=np.full((*planned.wings.light.shape[:2], 2), 0.7), _veils={})
    first, other = np.array([[0.3], [0.0]]), np.array([[0.0], [0.9]])
    np.testing.assert_allclose(wings.veil(first) + wings.veil(other), wings.veil(first + other), rtol=1e-6)
    np.testing.assert_allclose(wings.image_share[0] * 0.84 + wings.veil(first + other)[0], 0.84, rtol=1e-6)


@pytest.mark.parametrize("blades", [0, 5, 7])
def test_light_from_beyond_grows_with_the_edge_of_the_pupil(blades):
    """What a kernel of wave optics lacks is what the wings have of it, and what lies beyond them."""
    pupil = Pupil(blades=blades or None, rotation_deg=11.0)
    opening = Opening(pupil.depth, pupil.corner_radius, blades, math.radians(11.0)) if blades else ROUND
    optics = plan(shot_at(8.0, bright_and_dark())).optics
    psf = dataclasses.replace(optics.psf, lens_psf=dataclasses.replace(optics.psf.lens_psf, opening=opening))
    found = dataclasses.replace(psf.fit_kernel(0.0), cells=3)
    lacking = 1.0 - found.cell_kernel(0, 0.0, (0.0, 0.0)).sum()
    wings, _ = plan_wings(psf, optics.scene.planes, optics.weights, optics.projection, optics.accuracy)
    assert wings is not None
    assert 1.0 - wings.image_share[0] == pytest.approx(lacking * (1.0 - 1.0 / 32.0), rel=0.06)
