"""Aberrations in a scene with depth, gathered on the device: against exact kernels in float64, and against tolerance 0."""

import dataclasses
import math

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from audit.shot_truth import run
from helpers.aberrated_walls import SPHERICAL, depth_at, depth_map, thin_lens
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, PITCH_UM
from helpers.kernels_alone import without_layer_rays
from helpers.psf_frames import BRIGHTEST_E, MARGIN, SIDE, contrasts, error, shot_of
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.signal import fftconvolve

from simulator.config import load_shot
from simulator.device import Device
from simulator.exposure.settings import Exposure
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.psf_mosaic import psf_mosaic
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.kernel_split import TAIL_MARGIN_PX
from simulator.optics.psf.slab_kernels import slab_kernels_of
from simulator.optics.pupil.pupil import Aperture
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window


@pytest.mark.parametrize(("f_number", "radius_px"), [(8.0, 2.2), pytest.param(5.6, -1.6, marks=pytest.mark.slow)])
def test_light_of_each_wall_is_convolved_with_its_exact_kernel(f_number, radius_px):
    """Away from the step between them, to a tenth of the noise in p99.9."""
    planes, through = contrasts(), thin_lens(f_number, SPHERICAL)
    shot = shot_of(planes, through, depth_map(through, radius_px, 0.3))
    psf = plan(shot).optics.psf
    assert psf is not None and psf.is_gathered_by_distance
    left, right = slice(0, SIDE // 2 - 24), slice(SIDE // 2 + 24, SIDE)
    for here_px, columns in ((radius_px, left), (0.3, right)):
        exact = dataclasses.replace(psf, radii_px=(here_px,), core=None).kernel(0, 0, False, 0, 0)[0]
        assert error(shot, planes, exact, (slice(None), columns)) < 0.1


@pytest.mark.parametrize("tolerance", [0.3, 0.03])
def test_kernels_of_a_fast_lens_on_wide_photosites_are_as_exact_as_asked(tolerance):
    """They hold detail of a seventh of a photosite, and most of what diffraction scatters within a few of them.

    Against kernels of 19 cells per photosite; 0.04 of the noise is where those end.
    """
    planes, through, wide = contrasts(), thin_lens(2.8, SPHERICAL), 8.0 / PITCH_UM
    shot = shot_of(planes, through, depth_map(through, 0.8 * wide, 0.1 * wide), pixel_pitch_um=wide * PITCH_UM)
    shot = dataclasses.replace(shot, tolerance=tolerance)
    psf = plan(shot).optics.psf
    assert psf is not None and psf.is_gathered_by_distance
    left, right = slice(0, SIDE // 2 - 24), slice(SIDE // 2 + 24, SIDE)
    for here_px, columns in ((0.8, left), (0.1, right)):
        lens_psf = dataclasses.replace(psf.fit_kernel(here_px), cells=19)
        exact = square_kernel(lens_psf.cell_kernel(0, here_px, (0.0, 0.0)), 19)
        assert error(shot, planes, exact, (slice(None), columns)) < tolerance + 0.04


def square_kernel(cells: np.ndarray, per_photosite: int) -> np.ndarray:
    """What photosites see of a pixel as large as they are, from the light of a point in cells, float64, sum 1."""
    reach = len(cells) // per_photosite // 2 + 1
    away = (np.arange(len(cells)) - len(cells) // 2) / per_photosite
    shared = np.maximum(1.0 - np.abs(away - np.arange(-reach, reach + 1)[:, None]), 0.0)
    found = shared @ cells @ shared.T
    return np.asarray(found / found.sum())


def smooth_light(planes: np.ndarray, cells: int) -> np.ndarray:
    """Bilinear light of a scene on cells of photosites with a margin, float64."""
    scale = len(planes) / SIDE
    place = ((np.arange(cells * (SIDE + 2 * MARGIN)) + 0.5) / cells - MARGIN) * scale - 0.5
    return map_coordinates(planes.astype(float), np.meshgrid(place, place, indexing="ij"), order=1, mode="nearest")


def open_line(cells: int, fill_factor: float, apart_px: float) -> np.ndarray:
    """Share of each cell around a photosite's middle in its open part behind the spots of a filter, along an axis."""
    middle, found, half = (np.arange(2 * cells + 1) - cells) / cells, 0.0, 0.5 * math.sqrt(fill_factor)
    for spot in (-0.5 * apart_px, 0.5 * apart_px):
        first, last = np.maximum(middle - 0.5 / cells, spot - half), np.minimum(middle + 0.5 / cells, spot + half)
        found = found + np.maximum(last - first, 0.0)
    return np.asarray(found / found.sum())


def two_smooth_walls(**settings: float) -> tuple[Shot, np.ndarray, dict[float, slice]]:
    """Pixels of 2.5 photosites on walls of two blur radii; the pixels, and the columns of each radius away from the step."""
    rng = np.random.default_rng(4)
    planes = 0.1 + 0.9 * np.kron(rng.random((16, 16)) < 0.5, np.ones((4, 4))) * (0.5 + 0.5 * rng.random((64, 64)))
    through, coarse = thin_lens(8.0, SPHERICAL), 3.0
    walls = {1.2: slice(0, SIDE // 2 - 16), -0.6: slice(SIDE // 2 + 16, SIDE)}
    left_m, right_m = (float(depth_at(through, coarse * here_px)) for here_px in walls)
    depth_m = np.where(np.arange(64) < 32, left_m, right_m)[None, :].repeat(64, axis=0).astype(np.float32)
    shot = shot_of(planes, through, depth_m, "bilinear", pixel_pitch_um=coarse * PITCH_UM, **settings)
    return shot, planes, walls


@pytest.mark.slow
@pytest.mark.parametrize(("fill_factor", "low_pass_um"), [(1.0, 0.0), (0.6, 0.0), (0.6, 4.0)])
def test_smooth_light_of_each_wall_has_the_exact_blur(fill_factor, low_pass_um):
    """Pixels of 2.5 photosites: bilinear light, lens, filter and open areas in float64 on cells, no kernels between photosites.

    To a tenth of the noise of the brightest light, and in the noise of each photosite within what the plan states.
    """
    cells = 9
    shot, planes, walls = two_smooth_walls(fill_factor=fill_factor, low_pass_um=low_pass_um)
    planned, found = plan(shot), simulate(shot).mean_electrons.astype(np.float64)
    psf = planned.optics.psf
    assert psf.is_gathered_by_distance and psf.seen.is_smooth
    assert slab_kernels_of(psf, 1).reach_px.max() <= psf.core.reach_px
    light, line = smooth_light(planes, cells), open_line(cells, fill_factor, low_pass_um / psf.pitch_um)
    for here_px, columns in walls.items():
        lens_psf = dataclasses.replace(psf.fit_kernel(here_px), cells=cells)
        blurred = fftconvolve(light, lens_psf.cell_kernel(0, here_px, (0.0, 0.0)), mode="same")
        inside = fftconvolve(blurred, np.outer(line, line), mode="same")[cells // 2 :: cells, cells // 2 :: cells]
        own, truth = found[:, columns], inside[MARGIN:-MARGIN, MARGIN:-MARGIN][:, columns]
        truth_e = truth * BRIGHTEST_E
        off_e = own * truth.sum() / own.sum() * BRIGHTEST_E - truth_e
        assert np.quantile(np.abs(off_e), 0.999) < 0.1 * math.sqrt(BRIGHTEST_E)
        assert np.quantile(np.abs(off_e) / np.sqrt(truth_e), 0.999) < planned.error_budget.predicted_sigma


def test_open_areas_over_smooth_light_take_no_finer_samples():
    planned = plan(dataclasses.replace(two_smooth_walls(fill_factor=0.6)[0], tolerance=1.0))
    assert planned.optics.psf.is_gathered_by_distance and planned.optics.psf.over == 1
    assert planned.error_budget.predicted_sigma <= 1.0


def test_open_areas_take_finer_samples_where_these_alone_keep_the_tolerance():
    planned = plan(dataclasses.replace(two_smooth_walls(fill_factor=0.6)[0], tolerance=0.35))
    assert planned.optics.psf.over == 2 and planned.error_budget.predicted_sigma <= 0.35


@pytest.mark.parametrize("aperture", [None, pytest.param(Aperture(blades=9, rotation_deg=11.0), marks=pytest.mark.slow)])
def test_kernels_vary_over_the_field(aperture):
    """Coma, on a frame as wide as its field: photosites against exact kernels of their places; a window has the same bits."""
    planes = contrasts()
    through = dataclasses.replace(thin_lens(8.0, Aberrations(spherical_um=0.2, coma_um=0.3)), aperture=aperture)
    shot = shot_of(planes, through, depth_map(through, 1.0, 1.5))
    psf, found = plan(shot).optics.psf, simulate(shot).mean_electrons.astype(np.float64)
    assert psf.is_gathered_by_distance and psf.nodes != (1, 1)
    places = [(20, 20), (20, 110), (130, 40), (75, 120), (140, 140), (50, 10)]
    truth = np.array([photosite(planes, psf, row, column, 1.0 if column < SIDE // 2 else 1.5) for row, column in places])
    own = np.array([found[place] for place in places])
    mirrored = np.array([photosite(planes, psf, row, column, 1.25, -1.0) for row, column in places])
    scale = float(own @ truth / (truth @ truth))
    noise = np.sqrt(np.maximum(scale * truth, 1.0))
    assert np.abs((own - scale * truth) / noise).max() < 0.1
    assert np.abs((own - scale * mirrored) / noise).max() > 1.0  # the direction of the field matters
    window = Window(37, 51, 70, 46)
    part = simulate(dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, window=window))).mean_electrons
    np.testing.assert_array_equal(part, found[51:97, 37:107].astype(np.float32))


def photosite(planes: np.ndarray, psf: FieldPsf, row: int, column: int, radius_px: float, side: float = 1.0) -> float:
    """Light of one photosite with the kernel of its place; side -1: of the place on the other side of the centre."""
    half_diagonal = side * 0.5 * math.hypot(SIDE, SIDE)
    field_xy = (column + 0.5 - 0.5 * SIDE) / half_diagonal, (row + 0.5 - 0.5 * SIDE) / half_diagonal
    lens_psf = psf.fit_kernel(radius_px)
    kernel = square_kernel(lens_psf.cell_kernel(0, radius_px, field_xy), lens_psf.cells)[::-1, ::-1]
    half, lit = len(kernel) // 2, np.pad(planes, MARGIN, mode="edge")
    down, right = (slice(place + MARGIN - half, place + MARGIN + half + 1) for place in (row, column))
    return float((lit[down, right] * kernel).sum())


@pytest.mark.parametrize(
    ("aberrations", "tolerance"),
    [(SPHERICAL, 0.1), pytest.param(Aberrations(spherical_um=0.1, coma_um=0.3), 0.3, marks=pytest.mark.slow)],
    ids=["spherical", "coma"],
)
def test_surfaces_occlude_each_other_as_by_transforms(aberrations, tolerance):
    """A step between two walls, against transforms (tolerance 0), at 2,000 e-; with coma kernels in a row reach unlike far.

    Beside the step the wide tails are those of the sharp picture, which nothing occludes.
    """
    planes, through = 0.3 + 0.7 * contrasts(), thin_lens(8.0, aberrations)
    shot = dataclasses.replace(shot_of(planes, through, depth_map(through, 1.5, -1.0)), tolerance=tolerance)
    psf = plan(shot).optics.psf
    assert psf is not None and np.ptp(slab_kernels_of(psf, 1).reach_px, axis=1).any() == (aberrations.coma_um > 0.0)
    found, truth = (simulate(dataclasses.replace(shot, tolerance=one)).mean_electrons.astype(float) for one in (tolerance, 0.0))
    z = np.abs(found - truth) / np.sqrt(truth)
    assert np.quantile(z, 0.9) < 0.1 and np.quantile(z, 0.99) < 0.35


def two_layers(tolerance: float) -> Shot:
    """Squares with a texture before squares with a texture, on either side of the focus."""
    through, side = thin_lens(5.6, SPHERICAL), 64
    planes = 0.1 + 0.9 * contrasts()[:side, SIDE - side :]
    cover = np.kron(np.random.default_rng(5).random((8, 8)) > 0.5, np.ones((8, 8))).astype(np.float32)
    wall = Layer(np.ascontiguousarray(planes[::-1, :, None], np.float32), float(depth_at(through, 4.0)))
    near = float(depth_at(through, -4.0))
    scene = band_scene(planes * cover, near, coverage=cover, behind=(wall,), interpolation="nearest")
    return Shot(scene, through, Exposure(0.2 * EXPOSURE.time_s), green_camera(side, side), tolerance=tolerance)


@pytest.mark.slow
def test_covariance_that_no_kernel_spreads_is_stated(device):
    """Points add it over the aperture and a photosite alone, as rays of tolerance 0 show: 0.57 sigma where 0.3 were stated."""
    shot = two_layers(0.3)
    planned, exact = (measure(plan(one), device) for one in (shot, dataclasses.replace(shot, tolerance=0.0)))
    found, truth = (electrons_of(one, one.tiles, device) for one in (planned, exact))
    noise = np.sqrt(truth + planned.optics.accuracy.read_noise_e**2)
    left = float(np.quantile(np.abs(found - truth) / noise, 0.999))
    assert exact.optics.layer_rays and 0.4 < left < planned.error_budget.predicted_sigma < 2.0 * left


def test_layers_out_of_focus_have_their_covariance(device):
    """By the device against the kernels of tolerance 0: within what the plan states; a window has the same bits."""
    shot = two_layers(0.3)
    exact = without_layer_rays(plan(dataclasses.replace(shot, tolerance=0.0)))
    planned, exact = (measure(one, device) for one in (plan(shot), exact))
    assert planned.optics.psf.is_gathered_by_distance and planned.tiles.only_covariance
    found, truth = (electrons_of(one, one.tiles, device) for one in (planned, exact))
    means = electrons_of(planned, None, device)
    noise = np.sqrt(truth + planned.optics.accuracy.read_noise_e**2)
    left, lacking = (float(np.quantile(np.abs(one - truth) / noise, 0.999)) for one in (found, means))
    spread = next(one.sigma for one in planned.error_budget.terms if "each layer by itself" in one.cause)
    assert left < planned.error_budget.predicted_sigma - spread <= 0.3 and lacking > 3.0 * left
    told, without = (next(step for step in one.passes if step.name == "point spread function") for one in (planned, plan(shot)))
    assert "covariance of layers" in told.method and told.cost_ms > without.cost_ms
    window = Window(9, 13, 40, 30)
    cropped = measure(plan(dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, window=window))), device)
    np.testing.assert_array_equal(electrons_of(cropped, cropped.tiles, device), found[13:43, 9:49])


def electrons_of(planned: Plan, tiles: TilePlan | None, device: Device) -> np.ndarray:
    """Mean electrons of a frame. tiles: blocks that add the covariance; None: none do."""
    optics = planned.optics
    planes = [camera_planes(device, layer, optics.weights, optics.has_coverage) for layer in optics.scene.layers]
    light, shape = psf_mosaic(optics, tiles, device, planes, lambda share: None), (optics.window.height, optics.window.width)
    return optics.accuracy.electrons_per_radiance * device.download(light, shape, np.float32)


@pytest.mark.slow
def test_kernels_wider_than_their_tail_hold_all_light(device, tmp_path):
    """A wall out of focus by 11 photosites behind one in focus: its kernels end beyond the tail of the latter."""
    shot = load_shot(draw_shot(6401, 124).write(tmp_path))
    planned = measure(plan(shot), device)
    assert planned.optics.psf is not None and planned.optics.psf.is_gathered_by_distance
    sharp = dataclasses.replace(shot, lens=dataclasses.replace(shot.lens, diffraction=False))
    found, geometric = (run(one, own, device) for one, own in ((planned, shot), (measure(plan(sharp), device), sharp)))
    assert found.mean() == pytest.approx(geometric.mean(), rel=2e-3)


@pytest.mark.slow
def test_a_tail_wider_than_the_kernels_beside_it_finds_its_cells(device, tmp_path):
    """Of the kernel in focus, 129 photosites wide, where those a little out of focus have 81: it read beside its memory."""
    shot = load_shot(draw_shot(6501, 158).write(tmp_path))
    planned = measure(plan(shot), device)
    psf = planned.optics.psf
    assert psf is not None and psf.is_gathered_by_distance and psf.fit_kernel(0.0).size_px > 1.4 * (2 * psf.reach_px + 1)
    kernels = slab_kernels_of(psf, planned.optics.channels)
    half_px = kernels.cell_px * (kernels.tail.shape[-1] // 2)
    assert half_px < TAIL_MARGIN_PX and half_px + 2 * kernels.cell_px <= psf.gather_reach_px
    exact = dataclasses.replace(shot, tolerance=0.0)
    found, truth = run(planned, shot, device), run(measure(without_layer_rays(plan(exact)), device), exact, device)
    noise_e = np.sqrt(np.maximum(truth + planned.optics.accuracy.read_noise_e**2, 1.0))
    assert np.quantile(np.abs(found - truth) / noise_e, 0.99) < 0.2


@pytest.mark.slow
def test_the_dark_of_a_near_layer_does_not_see_the_tail_of_the_light_it_hides(device, tmp_path):
    """Both near the focus, 70 e- before 19,000: the core took away less than the tail had too much, by 2.5 sigma.

    Composited before the light between their pixels is, as layers are whose blur is left out, they would be 24 sigma off.
    """
    shot = load_shot(draw_shot(6601, 77).write(tmp_path))
    exact = dataclasses.replace(shot, tolerance=0.0)
    planned = measure(plan(shot), device)
    assert planned.optics.psf is not None and planned.optics.psf.is_gathered_by_distance
    found, truth = run(planned, shot, device), run(measure(without_layer_rays(plan(exact)), device), exact, device)
    noise_e = np.sqrt(np.maximum(truth + planned.optics.accuracy.read_noise_e**2, 1.0))
    assert np.quantile(np.abs(found - truth) / noise_e, 0.999) < 0.3


@pytest.mark.parametrize(
    "aberrations",
    [SPHERICAL, pytest.param(Aberrations(spherical_um=0.4, coma_um=0.4), marks=pytest.mark.slow)],
    ids=["spherical", "coma"],
)
def test_nothing_is_darker_beside_lamps(aberrations):
    """Kernels between photosites as wide as their spots ring: the dark beside lamps had a tenth of its light."""
    through, wide = thin_lens(8.0, aberrations), 8.0 / PITCH_UM
    coarse = SIDE * 3 // 4  # pixels: squares of the size of photosites have kernels that do not ring
    depth_m, dark = depth_map(through, 0.8 * wide, 0.1 * wide)[:coarse, -coarse:], np.full((coarse, coarse), 0.02)
    lit = dark.copy()
    lit[coarse // 4 :: 17, 5::19] = 400.0
    shot = shot_of(lit, through, depth_m, "bilinear", pixel_pitch_um=8.0)
    planned = plan(shot)
    assert planned.optics.psf is not None and slab_kernels_of(planned.optics.psf, 1).rings.any()
    unlit = dataclasses.replace(shot, scene=band_scene(dark, depth_m, interpolation="bilinear"))
    share = simulate(shot).mean_electrons / simulate(unlit).mean_electrons
    assert share.min() > 0.87
