"""Highlights where surfaces occlude each other: their spots against the one ray through the aperture that shows them."""

import dataclasses

import numpy as np
import pytest
from helpers.lens_error import z_scores
from helpers.lens_frame import blurred_case, case_plan
from helpers.lens_truths import Case

from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.highlights import (
    MOST_PER_CELL,
    Highlights,
    find_reaching,
    highlight_threshold,
    select_brightest,
    spot_weights,
)
from simulator.optics.pupil.pupil import Pupil

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


def test_only_what_stands_out_of_the_scene_is_a_highlight():
    plain = case_plan(half_plane_before_lights(False, {}))
    assert highlight_threshold(plain.optics.scene, plain.optics.weights) is None
    lit = case_plan(half_plane_before_lights(False, {(48, 120): 500.0}))
    limit = highlight_threshold(lit.optics.scene, lit.optics.weights)
    wall = lit.optics.scene.layers[1].planes.astype(float)
    assert np.allclose(
        limit, 8.0 * max(wall.mean(), lit.optics.scene.planes.mean(dtype=float)) * lit.optics.weights.sum(axis=0), rtol=1e-4
    )


def some_highlights(rows, columns, radii) -> Highlights:
    count = len(rows)
    excess = np.arange(1.0, count + 1.0, dtype=np.float32)[None]
    return Highlights(np.array(rows), np.array(columns), np.zeros(count, int), np.array(radii, np.float32), excess)


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


def test_a_highlight_reaches_the_blocks_that_its_spot_touches():
    lights = some_highlights([100], [200], [20.0])
    corners = np.array([(row, column) for row in range(0, 200, 8) for column in range(0, 400, 32)])
    lists = find_reaching(lights, Pupil(), 1, corners[:, 0], corners[:, 1])
    y, x = np.mgrid[:200, :400]
    touched = np.hypot(x - 200, y - 100) <= 20.0
    for (row, column), own in zip(corners, lists, strict=True):
        if touched[row : row + 8, column : column + 32].any():
            assert own.tolist() == [0]
    assert sum(len(own) for own in lists) < 40  # of 325


@pytest.mark.parametrize("samples_per_axis", [1, 2])
def test_every_spot_gives_all_of_its_light(samples_per_axis):
    lights = some_highlights([5, 6, 7], [1, 2, 3], [-3.0, 8.25, 8.26])
    weights, first, side = spot_weights(lights, Pupil(6), samples_per_axis)
    assert first[1] == first[2] and side.tolist()[1] > side.tolist()[0]
    for start, size in zip(first, side, strict=True):
        assert np.isclose(weights[start : start + size**2].sum(), 1.0, rtol=1e-6)
