"""Range of the light within blur circles by their size, on which the error of means between tabulated radii depends."""

import dataclasses
import math

import numpy as np
import pytest
from audit.shot_truth import run, true_electrons, z_scores
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.around_contrast import AROUND_PX, around_contrast
from simulator.optics.defocus.edge_laws import inside_px, nodes_error
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer

ROWS, COLUMNS = 48, 64
NODES = "images of the aperture between radii that are tabulated"


def tilted_shot(light: np.ndarray, radii_px: np.ndarray, scale: int = 1, **layers) -> Shot:
    """A wall whose blur radius grows from column to column, on photosites of `scale` pixels."""
    depth_m = np.asarray(depth_of(np.broadcast_to(radii_px, light.shape)))
    return Shot(band_scene(light, depth_m, **layers), LENS, Exposure(0.001), small_camera(COLUMNS, ROWS // scale))


def optics_of(light: np.ndarray, radii_px: np.ndarray, **layers) -> OpticsPlan:
    return plan(tilted_shot(light, radii_px, **layers)).optics


def stripes() -> np.ndarray:
    """Even light with stripes in the last third."""
    light = np.full((ROWS, COLUMNS), 0.5)
    light[:, 2 * COLUMNS // 3 :: 2] = 1.0
    return light


@pytest.mark.parametrize("way", [1, -1])
def test_light_counts_for_the_circles_that_see_it(way):
    """From focus to a radius of 8: stripes lie among the large circles, or among the small ones."""
    around = optics_of(stripes(), np.linspace(0.0, 8.0, COLUMNS)[::way]).contrast.around
    small, large = max(around[: AROUND_PX.index(2.0)]), max(around[AROUND_PX.index(12.0) :])
    assert (small, large)[way < 0] == 0.0 and (large, small)[way < 0] > 0.3


@pytest.mark.parametrize("dark", [0.01, 0.1])
def test_a_difference_counts_in_the_noise_of_what_the_circle_sees(dark):
    """Stripes that differ by a hundredth of the brightest light: where it is dark they are seen more clearly."""
    light, radii_px = np.full((ROWS, COLUMNS), dark), np.full(COLUMNS, 1.2)
    light[:, ::2] += 0.01
    light[:, -16:], radii_px[-24:] = 1.0, 2.5
    optics = optics_of(light, radii_px + 0.001 * np.arange(COLUMNS))
    electrons, floor_e2 = optics.accuracy.electrons, optics.accuracy.read_noise_e**2
    seen = 0.01 * math.sqrt((electrons + floor_e2) / ((dark + 0.005) * electrons + floor_e2))
    assert optics.contrast.around[AROUND_PX.index(1.5)] == pytest.approx(seen, rel=0.15)  # circles hold one stripe more


def test_what_hardly_any_photosite_sees_does_not_count():
    light, radii_px = np.full((ROWS, COLUMNS), 0.5), np.full(COLUMNS, 4.0) + 0.01 * np.arange(COLUMNS)
    radii_px[0] = 1.2
    few = optics_of(light, radii_px).defocus
    picture = light[..., None].copy()
    picture[0, 0] = 1.0
    spread = around_contrast([(picture, None)], few, 1.0, 1)
    assert spread[AROUND_PX.index(1.5)] > 0.0  # a column of 48
    sky = np.full((ROWS, COLUMNS), 4.0)
    sky[0, :2] = 1.2, 1.2
    rare = dataclasses.replace(few, radii_px=(sky,))
    assert around_contrast([(picture, None)], rare, 1.0, 1)[AROUND_PX.index(1.5)] == 0.0  # 2 of 3072


def test_a_wall_behind_an_edge_counts_with_its_own_light():
    """An even wall behind disks that are at one distance: their edge is an image of one radius, which is tabulated."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    hole = (np.hypot(y - 24, x - 30) < 9).astype(float)
    radii_px = np.linspace(0.6, 1.4, COLUMNS) * np.ones((ROWS, 1))
    wall = Layer(np.full((ROWS, COLUMNS, 1), 0.5, np.float32), np.asarray(depth_of(radii_px), np.float32))
    near = Shot(
        band_scene(1.0 * hole, float(depth_of(3.0)), coverage=hole.astype(np.float32), behind=(wall,)),
        LENS,
        Exposure(0.001),
        small_camera(COLUMNS, ROWS),
    )
    assert max(plan(near).optics.contrast.around) == 0.0
    tilted = tilted_shot(
        1.0 * hole, radii_px, coverage=hole.astype(np.float32), behind=(dataclasses.replace(wall, depth_m=3.0),)
    )
    assert max(plan(tilted).optics.contrast.around) > 0.3


def test_what_an_edge_lies_before_is_out_of_focus_too():
    """A dark tilted layer before bright dots far apart: their light lies behind its edge where none is at rest."""
    cover = np.zeros((ROWS, COLUMNS), np.float32)
    cover[:, :32] = 1.0
    dots = np.zeros((ROWS, COLUMNS, 1), np.float32)
    dots[4::12, 40::12] = 1.0
    radii_px = np.linspace(0.6, 0.9, COLUMNS) * np.ones((ROWS, 1))
    shot = tilted_shot(0.0 * cover, radii_px, coverage=cover, behind=(Layer(dots, float(depth_of(9.0))),))
    assert plan(shot).optics.contrast.around[AROUND_PX.index(0.75)] > 0.01


def test_circles_inside_a_photosite_have_no_images_between_radii(device):
    """One pixel per photosite: all tabulated images are that pixel, whatever light is around."""
    assert inside_px(1.0) == 0.5 and inside_px(1.56) == 0.25
    light = np.where(np.random.default_rng(2).random((ROWS, COLUMNS)) < 0.5, 0.02, 1.0)
    inside, beyond = (measure(plan(tilted_shot(light, np.linspace(0.3, most, COLUMNS))), device) for most in (0.49, 0.6))
    assert inside.optics.defocus is not None and inside.error_budget.predicted_sigma < 1e-3
    assert any(term.cause == NODES for term in beyond.error_budget.terms)
    assert np.array_equal(run(inside, tilted_shot(light, np.linspace(0.3, 0.49, COLUMNS)), device), run_sharp(light, device))


def test_light_beyond_the_circles_that_occur_leaves_nothing():
    """From the focus on, where circles are smallest, images miss most of what those see that begin to leave their photosite."""
    near, far = (tuple(float(size == number) for size in range(len(AROUND_PX))) for number in (0, AROUND_PX.index(12.0)))
    assert nodes_error(0.0, 8.0, near, 100.0) > nodes_error(0.0, 8.0, far, 100.0) > 0.0
    assert nodes_error(0.3, 8.0, near, 100.0) == nodes_error(0.0, 5.0, far, 100.0) == nodes_error(0.3, 0.3, near, 100.0) == 0.0
    assert nodes_error(0.0, 8.0, near, 1e-6) < 1e-6  # even light bends nowhere


def run_sharp(light: np.ndarray, device) -> np.ndarray:
    shot = tilted_shot(light, np.full(COLUMNS, 1e-6))
    return run(measure(plan(shot), device), shot, device)


@pytest.mark.slow
def test_small_circles_of_a_fine_layer_behind_others_are_stated(device):
    """Squares of a tilted wall behind a layer in focus: they are not gathered one by one, as those of a single surface are."""
    rng = np.random.default_rng(5)
    shape = 41, 62  # 2.6 to a photosite
    cover = np.zeros(shape, np.float32)
    cover[:, :8] = 1.0
    radii_px = np.linspace(0.4, 0.46, shape[1]) * np.ones((shape[0], 1))
    wall = Layer(
        np.where(rng.random((*shape, 1)) < 0.5, 0.05, 1.0).astype(np.float32), np.asarray(depth_of(radii_px), np.float32)
    )
    scene = band_scene(0.3 * cover, float(depth_of(0.0)), coverage=cover, behind=(wall,))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(24, 16))
    planned = measure(plan(shot), device)
    (nodes,) = (term.sigma for term in planned.error_budget.terms if term.cause == NODES)
    true_e, sigma = true_electrons(shot, device, 0.1)
    found = np.quantile(np.abs(z_scores(run(planned, shot, device), true_e, planned)), 0.999)
    assert nodes > 0.1 and found - 3.3 * sigma < planned.error_budget.predicted_sigma
