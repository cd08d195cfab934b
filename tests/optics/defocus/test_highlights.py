"""Highlights where surfaces occlude each other: their spots against the one ray through the aperture that shows them."""

import dataclasses

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from audit.shot_truth import run
from helpers.camera_builders import small_camera
from helpers.lens_error import z_scores
from helpers.lens_frame import LENS, blurred_case, case_plan, depth_of
from helpers.lens_truths import Case
from helpers.scene_builders import band_scene

from simulator.config import load_shot
from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.defocus import Method
from simulator.optics.defocus.highlights import (
    MOST_PER_CELL,
    Highlights,
    find_reaching,
    highlight_threshold,
    select_brightest,
    spot_weights,
)
from simulator.optics.pupil.pupil import Pupil
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window

ROWS, COLUMNS, MARGIN, EDGE = 96, 192, 24, 110
NEAR_PX, FAR_PX = -6.0, 10.0


def half_plane_before_lights(single: bool, lights: dict[tuple[int, int], float]) -> Case:
    """A near half-plane of 0.5 before a wall of 0.3 with lights (row, column): extra radiance; as one picture or as layers."""
    near = np.broadcast_to(np.arange(COLUMNS) < EDGE, (ROWS, COLUMNS)).astype(float)
    far, whole = np.full((ROWS, COLUMNS), 0.3), np.ones((ROWS, COLUMNS))
    for place, radiance in lights.items():
        far[place] += radiance
    inner = np.zeros((ROWS - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    if single:
        colour, radius = np.where(near > 0, 0.5, far), np.where(near > 0, NEAR_PX, FAR_PX)
        return Case("single", colour[None], whole[None], radius[None], inner, MARGIN, 1, False)
    radius = np.stack([NEAR_PX * whole, FAR_PX * whole])
    return Case("layers", np.stack([0.5 * near, far]), np.stack([near, whole]), radius, inner, MARGIN, 1, False)


def spots(lights: dict[tuple[int, int], float]) -> np.ndarray:
    """Light of the spots, by the exact disk and by whether the half-plane cuts the ray from photosite to light."""
    weights = disk_weights(FAR_PX)
    reach, found = len(weights) // 2, np.zeros((ROWS, COLUMNS))
    x = np.arange(COLUMNS) + 0.5
    for (row, column), radiance in lights.items():
        meets_near_at = x + NEAR_PX * (column + 0.5 - x) / FAR_PX
        open_ = np.clip(meets_near_at - EDGE + 0.5, 0.0, 1.0)  # the near side is read bilinearly
        here = slice(row - reach, row + reach + 1), slice(column - reach, column + reach + 1)
        found[here] += radiance * weights * open_[here[1]]
    return found[MARGIN:-MARGIN, MARGIN:-MARGIN]


@pytest.mark.parametrize("single", [False, True])
def test_a_spot_beside_an_edge_has_no_dots(single):
    lights = {(48, 120): 500.0, (40, 131): 60.0}
    dark = blurred_case(half_plane_before_lights(single, dict.fromkeys(lights, 0.0)))
    found, truth = blurred_case(half_plane_before_lights(single, lights)) - dark, spots(lights)
    z = z_scores(found + dark, truth + dark, 2000.0)
    assert np.sqrt(np.mean(z[truth > 0] ** 2)) < (0.25 if single else 0.1) and np.abs(z).max() < (0.6 if single else 0.3)
    assert np.isclose(found.sum(), truth.sum(), rtol=1e-3)


def test_a_spot_that_nothing_hides_is_that_of_a_frame_without_edges():
    """Beyond the reach of the edge the spot is the mean over the aperture's image."""
    lights = {(48, 126): 500.0}
    case = half_plane_before_lights(True, lights)
    found = blurred_case(case)
    mean = blurred_case(dataclasses.replace(case, radius_px=np.full_like(case.radius_px, FAR_PX)))
    beyond = slice(EDGE + 16 - MARGIN, None)
    assert np.abs(z_scores(found[:, beyond], mean[:, beyond], 2000.0)).max() < 0.3


def test_a_hidden_lamp_leaves_the_sharp_surface_before_it_as_it_is():
    """Stripes in focus, two samples per photosite, before a blurred wall: the lamp is hidden, so it changes nothing."""
    y, x = np.mgrid[: 2 * ROWS, : 2 * COLUMNS]
    near = (x < 2 * EDGE).astype(float)
    stripes = near * (0.5 + 0.3 * np.cos(2.0 * np.pi * (0.8 * x + 0.6 * y) / 9.0))
    radius = np.stack([0.5 * np.ones_like(near), FAR_PX * np.ones_like(near)])
    inner, light = np.zeros((ROWS - 2 * MARGIN, COLUMNS - 2 * MARGIN)), []
    for radiance in (0.0, 2000.0):
        far = np.full(near.shape, 0.3)
        far[ROWS + 3, 2 * (EDGE - 14)] += radiance
        light.append(
            blurred_case(
                Case("hidden", np.stack([stripes, far]), np.stack([near, 0 * near + 1]), radius, inner, MARGIN, 2, True)
            )
        )
    assert np.abs(z_scores(light[1], light[0], 2000.0)).max() < 0.01


@pytest.mark.parametrize("tilted", [False, True])
def test_a_lamp_leaves_nothing_in_its_columns(tilted):
    """A lamp of 10^9 times the wall: outside its spot the wall is what it is without the lamp, inside it has all its light."""
    rows, light = 160, []
    radius = FAR_PX + (0.05 * (np.arange(COLUMNS) - 90) * np.ones((rows, 1)) if tilted else np.zeros((rows, COLUMNS)))
    inner = np.zeros((rows - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    for radiance in (0.0, 1e9):
        wall = np.full((rows, COLUMNS), 0.5)
        wall[80, 90] += radiance
        light.append(blurred_case(Case("lamp", wall[None], 0 * wall[None] + 1, radius[None], inner, MARGIN, 1, True)))
    y, x = np.mgrid[: inner.shape[0], : inner.shape[1]]
    spot = np.hypot(y + MARGIN - 80, x + MARGIN - 90) < FAR_PX + 2
    assert np.abs(z_scores(light[1], light[0], 2000.0))[~spot].max() < 0.01
    assert light[1][spot].sum() == pytest.approx(1e9, rel=1e-4)


def test_lamps_over_black_beside_an_edge_are_the_exact_disk():
    """1 e- around a lamp of 4 10^6, hidden: extend: photosites twice as wide left 106 to 390 sigma at rims."""
    rows, edge, radius_px, lamp = 96, 110, -7.0156, 4e6
    near = np.arange(COLUMNS) < edge
    radius = np.broadcast_to(np.where(near, radius_px, 8.0), (rows, COLUMNS))
    light, truth = np.ones((rows, COLUMNS)), np.ones((rows, COLUMNS))
    light[48, 88] += lamp
    weights = disk_weights(radius_px)
    reach = len(weights) // 2
    truth[48 - reach : 48 + reach + 1, 88 - reach : 88 + reach + 1] += lamp * weights
    inner = np.zeros((rows - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    case = Case("lamps", light[None], np.ones((1, rows, COLUMNS)), radius[None], inner, MARGIN, 1, False)
    found = blurred_case(case, electrons=1.0, hidden="extend")
    z = z_scores(found, truth[MARGIN:-MARGIN, MARGIN:-MARGIN], 1.0)
    assert np.abs(z[:, : edge - 9 - MARGIN]).max() < 0.1


@pytest.mark.parametrize("tolerance", [0.3, 0.1])
def test_a_lamp_as_small_as_a_photosite_has_no_dots_beside_it(tolerance, device):
    """Two surfaces that both lie near the focus, 1.25 photosites apart in radius: slabs are wider than the circle."""
    side, scale, radius_px = 24, 3, 0.52
    light, lamp = np.full((scale * side, scale * side), 0.5), (36, 60)
    radius = np.where(np.arange(scale * side) < 37, -0.73, radius_px) * np.ones_like(light)
    light[lamp] = 4000.0
    scene = band_scene(0.01 * light, np.asarray(depth_of(radius)))
    planned = measure(plan(Shot(scene, LENS, Exposure(0.001), small_camera(side, side), tolerance=tolerance)), device)
    assert planned.tiles.shares()[Method.OCCLUSION] > 0.0
    found = device.download(expose(planned, device), (side, side), np.float32).astype(np.float64)
    wall = np.median(found)
    middles = np.mgrid[:side, :side] + 0.5
    apart = [np.abs(own - (place + 0.5) / scale) - 0.5 - 0.5 / scale for own, place in zip(middles, lamp, strict=True)]
    is_outside = np.hypot(*np.maximum(apart, 0.0)) > radius_px
    assert np.abs(found / wall - 1.0)[is_outside].max() < 1e-4
    assert (found / wall - 1.0).sum() == pytest.approx((4000.0 / 0.5 - 1.0) / scale**2, rel=0.01)


def test_the_spot_of_a_lamp_on_a_tilted_surface_is_brighter_where_the_surface_recedes():
    """An area dp of a surface with the slope g fills (1 - g u) dp / s^2 of the aperture; 0.5 sigma of even light in it."""
    rows, slope = 160, 0.05
    radius = FAR_PX + slope * (np.arange(COLUMNS) - 90) * np.ones((rows, 1))
    wall = np.full((rows, COLUMNS), 0.5)
    wall[80, 90] += 1e6
    inner = np.zeros((rows - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    found = blurred_case(Case("lamp", wall[None], 0 * wall[None] + 1, radius[None], inner, MARGIN, 1, True))
    y, x = np.mgrid[: inner.shape[0], : inner.shape[1]]
    across, down = 90 - x - MARGIN, 80 - y - MARGIN
    inside = np.hypot(across, down) < FAR_PX - 1
    truth = 0.5 + 1e6 / (np.pi * FAR_PX**2) * (1 - slope * across / FAR_PX)
    assert np.abs(z_scores(found, truth, 0.02)[inside]).max() < 0.1


def test_only_what_stands_out_of_the_scene_is_a_highlight():
    plain = case_plan(half_plane_before_lights(False, {}))
    assert highlight_threshold(plain.optics.scene, plain.optics.weights) is None
    lit = case_plan(half_plane_before_lights(False, {(48, 120): 500.0}))
    limit = highlight_threshold(lit.optics.scene, lit.optics.weights)
    near, wall = (layer.planes.astype(float) for layer in lit.optics.scene.layers)
    wall = np.minimum(wall, np.quantile(wall, 0.99))
    assert np.allclose(limit, 8.0 * max(wall.mean(), near.mean()) * lit.optics.weights.sum(axis=0), rtol=1e-4)
    brighter = case_plan(half_plane_before_lights(False, {(48, 120): 500.0, (48, 140): 1e9}))
    found = highlight_threshold(brighter.optics.scene, brighter.optics.weights)
    assert np.allclose(found / brighter.optics.weights.sum(axis=0), limit / lit.optics.weights.sum(axis=0), rtol=1e-3)


def some_highlights(rows, columns, radii) -> Highlights:
    count = len(rows)
    excess = np.arange(1.0, count + 1.0, dtype=np.float32)[None]
    radii_px = np.array(radii, np.float32)
    where = np.array(rows), np.array(columns), np.zeros(count, int)
    return Highlights(*where, radii_px, np.zeros((2, count)), np.zeros(count, bool), excess)


def test_the_brightest_of_each_cell_are_kept_wherever_the_band_begins():
    rng = np.random.default_rng(3)
    rows, columns = rng.integers(0, 96, 200), rng.integers(0, 64, 200)
    lights = some_highlights(rows, columns, np.full(200, 5.0))
    kept = select_brightest(lights, 1, 0)
    cells = lights.rows // 32 * 2 + lights.columns // 32
    for cell in range(6):
        own = np.sort(lights.excess[0][cells == cell])[::-1][:MOST_PER_CELL]
        there = kept.rows // 32 * 2 + kept.columns // 32 == cell
        assert np.array_equal(np.sort(kept.excess[0][there])[::-1], own)
    later = lights.select(lights.rows >= 32)
    later = dataclasses.replace(later, rows=later.rows - 32)
    assert set(select_brightest(later, 1, 32).excess[0]) == set(kept.excess[0][kept.rows >= 32])
    mixed = dataclasses.replace(lights, radii_px=np.where(np.arange(200) % 2, 5.0, 0.5))
    large = lights.select(np.arange(200) % 2 == 1)
    both = select_brightest(mixed, 1, 0)  # small circles leave those of large ones their places
    assert set(both.excess[0][both.radii_px > 1.0]) == set(select_brightest(large, 1, 0).excess[0])


def test_highlights_reach_the_blocks_that_their_spots_touch():
    generator = np.random.default_rng(8)
    lights = some_highlights(*generator.integers(-20, 420, (2, 300)), generator.uniform(-60.0, 60.0, 300))
    corners = np.array(
        [(row, column) for row in range(0, 200, 8) for column in range(0, 400, 32) if (row, column) != (96, 192)]
    )
    reaching, counts = find_reaching(lights, Pupil(), 1, corners[:, 0], corners[:, 1])
    y, x = lights.rows + 0.5, lights.columns + 0.5
    for (row, column), own in zip(corners, np.split(reaching, np.cumsum(counts)[:-1]), strict=True):
        away = np.hypot(y - np.clip(y, row, row + 8), x - np.clip(x, column, column + 32))
        assert own.tolist() == np.flatnonzero(away <= np.abs(lights.radii_px) + 1.5).tolist()


@pytest.mark.parametrize("samples_per_axis", [1, 2])
def test_every_spot_gives_all_of_its_light(samples_per_axis):
    lights = some_highlights([5, 6, 7], [1, 2, 3], [-3.0, 8.25, 8.26])
    weights, first, side = spot_weights(lights, Pupil(6), samples_per_axis)
    assert first[1] == first[2] and side.tolist()[1] > side.tolist()[0]
    for start, size in zip(first, side, strict=True):
        assert np.isclose(weights[start : start + size**2].sum(), 1.0, rtol=1e-6)


@pytest.mark.parametrize(
    ("single", "tolerance"), [(False, 0.1), (False, 0.0), (True, 0.1), pytest.param(True, 0.0, marks=pytest.mark.slow)]
)
def test_a_crop_beside_lamps_has_the_bits_of_the_whole_frame(single, tolerance):
    """Lamps inside the crop, and outside it where their spots reach into it or only share its columns."""
    brightest = 1e9 if tolerance else 1e3
    lights = {(48, 120): 500.0, (40, 131): brightest, (70, 126): 80.0, (30, 80): 0.1 * brightest}
    planned = case_plan(half_plane_before_lights(single, lights), 20.0, tolerance)
    device, frames = open_device(), []
    for window in (Window(90, 30, 60, 40), Window(112, 40, 20, 12)):
        here = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=window))
        frames.append(device.download(expose(measure(here, device), device), (window.height, window.width), np.float32))
    np.testing.assert_array_equal(frames[1], frames[0][10:22, 22:42])


def test_a_lamp_is_hidden_by_what_is_nearer_at_any_tolerance(device, tmp_path):
    """One behind disks of 9 photosites' circle, of 10; few slabs of radius had both in one: 1,654 sigma at a tolerance of 1."""
    shot = load_shot(draw_shot(6701, 161).write(tmp_path))
    found, fine = (
        run(measure(plan(own), device), own, device)
        for own in (shot, dataclasses.replace(shot, tolerance=0.1 * shot.tolerance))
    )
    noise_e = np.sqrt(np.maximum(fine + plan(shot).optics.accuracy.read_noise_e ** 2, 1.0))
    assert shot.tolerance == 1.0 and np.quantile(np.abs(found - fine) / noise_e, 0.999) < 1.0
