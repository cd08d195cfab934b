"""The predicted error of the blur: not below what is found, small where the scene is smooth, and told where it is too large."""

import dataclasses

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from audit.float64_truth import exact_means, sum_rays
from audit.shot_truth import noise_electrons, run
from audit.shot_truth import z_scores as z_scores_of_noise
from helpers.camera_builders import small_camera
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import LENS, blurred_case, case_plan, depth_of
from helpers.lens_truths import Case, cases, square_light, uniform_layers
from helpers.scene_builders import band_scene
from helpers.textured_planes import one_picture, textured_planes, with_truth_of_rays
from scipy.ndimage import convolve, map_coordinates
from scipy.signal import fftconvolve

from simulator.config.shot_file import load_shot
from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.accuracy import Accuracy, grid_error, hidden_error, twice_blurred_share
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.lamp_laws import SPOT, rim_error, spot_error
from simulator.optics.defocus.predicted_error import LAYERS, error_terms, predicted_error, squares_left
from simulator.optics.defocus.square_kernel import disk_square_weights
from simulator.optics.lens.distortion import Distortion
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.occluded_background import Hidden
from simulator.scene.scene import Layer

LIGHTS = ("point", "square_light")


def predicted(planned: Plan) -> float:
    assert planned.optics.defocus is not None
    return predicted_error(planned.optics.defocus, planned.optics.contrast)


def check(case: Case, truth: Case, electrons: float, hidden: Hidden = "none", left: float = 0.0) -> None:
    """The prediction is at least what 99 % of |z| are. left: what the scene itself is off, such as a wave of even squares."""
    z = z_scores(blurred_case(case, electrons, hidden=hidden), truth.truth, electrons)
    assert np.quantile(np.abs(z), 0.99) <= predicted(case_plan(case, electrons, hidden=hidden)) + left


EITHER = [(2000.0, "none"), (20000.0, "extend")]
EVERY = [*EITHER, (2000.0, "extend"), (20000.0, "none")]


@pytest.mark.parametrize(
    ("radii_px", "pictures"),
    [
        pytest.param((-12.0, -4.0, 6.0), EVERY, marks=pytest.mark.slow),
        ((-8.0, 0.0, 8.0), EITHER),
        pytest.param((-8.0, 0.0, 8.0), EVERY, marks=pytest.mark.slow),
        pytest.param((0.0, 6.0, 14.0), EVERY, marks=pytest.mark.slow),
    ],
)
def test_it_is_not_below_what_textured_planes_have(radii_px, pictures):
    """As one picture with depth, with either background, and as layers."""
    case = with_truth_of_rays(textured_planes(radii_px, (112, 152)), open_device())
    for electrons, hidden in pictures:
        check(one_picture(case), case, electrons, hidden)
    check(case, case, 2000.0)


@pytest.mark.slow
def test_it_is_not_below_what_one_picture_before_a_uniform_wall_has():
    case = textured_planes((-10.0, -10.0, 3.0))
    case.colour[2], case.colour[1], case.coverage[1] = 0.8, 0.0, 0.0
    case = with_truth_of_rays(case, open_device())
    for hidden in ("none", "extend"):
        check(one_picture(case), case, 2000.0, hidden)
    for radii_px in ((-60.0, -30.0), (-50.0, 60.0)):
        closed_form = uniform_layers(*radii_px)
        check(one_picture(closed_form), closed_form, 2000.0, "extend")


@pytest.mark.slow
def test_it_is_not_below_what_closed_forms_and_lamps_have():
    waves = [case for case in cases(2, squares=True) if not case.name.startswith(LIGHTS)]  # even squares hold no points
    for case in [*waves, *(square_light(radius, n, 2000.0) for radius in (2.4, 12.0) for n in (1, 2, 4))]:
        check(case, case, 2000.0, left=0.03)


def test_it_is_small_where_the_scene_is_smooth():
    """Light from 0.1 to 1 over 200 photosites, a plane tilted through the focus: within a third of the usual tolerance."""
    y, x = np.mgrid[:96, :200]
    scene = band_scene(0.1 + 0.9 * (x + y) / 294.0, np.asarray(depth_of((x - 100) / 20.0)))
    planned = plan(Shot(scene, LENS, Exposure(0.001), small_camera(200, 96)))
    usual = dataclasses.replace(planned.optics.defocus.accuracy, electrons=2000.0, read_noise_e=2.0)
    defocus = dataclasses.replace(planned.optics.defocus, accuracy=usual)
    terms = error_terms(defocus, planned.optics.contrast)
    assert predicted_error(defocus, planned.optics.contrast) < 0.07 and len(terms) == 5
    assert statistics(np.array([term.sigma for term in error_terms(defocus)])).p99 > 0.5  # with the most contrast


def test_simulate_warns_where_the_tolerance_may_not_be_kept(capsys):
    """One picture with depth: the method's part, and apart from it the background that the picture does not show."""
    flat = one_picture(textured_planes((-8.0, 0.0, 8.0), (64, 80), margin=2))
    scene = band_scene(flat.colour[0], np.asarray(depth_of(flat.radius_px[0])))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(80, 64))
    told = simulate(shot).resolved
    method, hidden = told["warnings"]
    assert method.startswith("tolerance = 0.1 is not met: the lens blur may be wrong by") and "background" not in method
    assert hidden.startswith("lens blur: up to") and "background behind edges" in hidden and LAYERS in hidden
    assert plan(shot).warnings() == [method, hidden]
    assert told["error_budget"]["clamped"] and told["error_budget"]["input_sigma"] > 0.1
    for quiet in (
        dataclasses.replace(shot, tolerance=0.0),
        dataclasses.replace(shot, tolerance=10.0, scene=band_scene(np.ones((64, 80)), 3.0)),
        dataclasses.replace(shot, scene=band_scene(flat.colour[0], 2.0)),
    ):
        assert plan(quiet).warnings() == []


@pytest.mark.parametrize("radii_px", [(0.2, 0.5), (0.3, 0.4), (1.5, 1.6)])
def test_layers_with_circles_as_small_as_the_samples_have_a_term(radii_px, device):
    """Random squares before random squares, 2 pixels per photosite, against a sum over rays: a warning holds with its bound."""
    rng, side = np.random.default_rng(3), 24
    squares = (np.kron(rng.random((3, 12, 12)) > 0.5, np.ones((4, 4))) * 0.95 + 0.05).astype(np.float32)
    cover = (squares[0] > 0.5).astype(np.float32)
    front, back = (float(depth_of(radius)) for radius in radii_px)
    scene = band_scene(squares[1] * cover, front, coverage=cover, behind=(Layer(squares[2][..., None], back),))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(side, side))
    planned = measure(plan(shot), device)
    summed = sum_rays(shot, planned, sets=2, points=1024)
    z = np.abs(z_scores_of_noise(run(planned, shot, device), summed.electrons, planned))
    sigma = np.quantile(summed.error / noise_electrons(summed.electrons, planned), 0.99)
    term = next(term for term in planned.error_budget.terms if "small as the samples" in term.cause)
    assert planned.error_budget.is_clamped
    assert 0.05 * term.sigma < np.quantile(z, 0.99) <= planned.error_budget.predicted_sigma + 3.3 * sigma


def test_light_that_crosses_all_borders_of_a_photosite_is_stated_where_blur_is_left_out():
    """Waves of two photosites of 3 x 3 pixels, dark in the middle of every second, behind circles of a tenth, in float64."""
    per_px, parts, side, radius_px = 3, 8, 24, 0.1
    y, x = (np.mgrid[: per_px * side, : per_px * side] + 0.5) / per_px
    light = 0.53 + 0.47 * np.cos(np.pi * (x - 0.5)) * np.cos(np.pi * (y - 0.5))
    shot = Shot(band_scene(light, depth_of(radius_px)), LENS, Exposure(1e-3), small_camera(side, side), tolerance=6.0)
    planned = plan(shot)
    assert planned.optics.defocus is None
    fine = np.kron(light, np.ones((parts, parts)))
    blurred = fftconvolve(np.pad(fine, 16, mode="edge"), disk_weights(radius_px * per_px * parts), mode="same")[16:-16, 16:-16]
    means = [one.reshape(side, per_px * parts, side, -1).mean(axis=(1, 3)) for one in (fine, blurred)]
    accuracy = planned.optics.accuracy
    sharp_e, true_e = (accuracy.electrons_per_radiance * float(planned.optics.weights.max()) * one for one in means)
    found = np.quantile(np.abs(sharp_e - true_e) / np.sqrt(np.maximum(true_e + accuracy.read_noise_e**2, 1.0)), 0.999)
    assert 0.6 * planned.error_budget.predicted_sigma < found <= planned.error_budget.predicted_sigma


def test_a_gradient_behind_edges_counts_by_what_lies_beside_them(tmp_path):
    """Disks out of focus before a slope, smaller than their circles: the audit found 14.4 sigma, 9.8 were stated (seed 96)."""
    budget = plan(load_shot(draw_shot(96, 10).write(tmp_path))).error_budget
    assert 14.4 < budget.total_sigma < 30.0


def test_circles_smaller_than_photosites_hide_a_part_of_them():
    """Share of the aperture that sees past a straight edge, mean over places from it to the rim, in float64."""
    way = (np.arange(4000) + 0.5) / 4000
    beyond = np.mean((np.arccos(way) - way * np.sqrt(1.0 - way**2)) / np.pi)
    for radius_px in (0.01, 0.1, 0.3, 2.0):
        assert hidden_error(1.0, radius_px) == pytest.approx(min(4.0 * beyond * radius_px, 0.5), rel=1e-4)


@pytest.mark.parametrize("radius_px", [2.0, 4.0, 8.0])
def test_means_of_waves_of_even_squares_leave_what_waves_leave(radius_px):
    """Two pixels to a photosite and one sample, in float64: not three times as much, as of random squares."""
    parts, size, scale = 12, 64, 2
    x = np.arange(size * scale) + 0.5
    picture = 0.5 + 0.5 * np.sin(2.0 * np.pi * (0.8 * x + 0.6 * x[:, None]) / (9.0 * scale))
    fine = np.kron(picture, np.ones((parts // scale, parts // scale)))

    def photosites(light):
        return light.reshape(size, parts, size, parts).mean(axis=(1, 3))

    truth = photosites(fftconvolve(fine, disk_weights(parts * radius_px), mode="same"))
    found = fftconvolve(photosites(fine), disk_weights(radius_px), mode="same")
    left = np.quantile(np.abs(found - truth)[10:-10, 10:-10], 0.999)
    detail = float(np.abs(np.diff(picture, axis=1)).max())
    stated = squares_left(Accuracy(detail=detail), radius_px, 1, float(scale))
    assert left <= stated
    if radius_px > 4.0:
        assert stated == grid_error(radius_px, 1, float(scale))


@pytest.mark.parametrize(
    ("scale", "fill_factor"),
    [(3, 0.8), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((3, 1.0), (3, 0.6), (5, 1.0), (5, 0.8)))],
)
def test_slow_waves_of_even_squares_that_fall_to_the_dark_state_their_bends(scale, fill_factor, device):
    """Waves of 9 to 40 photosites at any angle, against exact weights of squares in float64; samples divide no pixels."""
    size, ratios = 48, []
    rows, columns = (np.mgrid[: size * scale, : size * scale] + 0.5) / scale
    for seed in range(6):
        rng = np.random.default_rng(seed)
        angle, length, radius_px = rng.uniform(0.0, np.pi), rng.uniform(9.0, 40.0), rng.uniform(2.5, 9.0)
        wave = np.sin(2.0 * np.pi * (rows * np.sin(angle) + columns * np.cos(angle)) / length + rng.uniform(0.0, 6.0))
        scene = band_scene(0.02 + 0.49 * (1.0 + wave), float(depth_of(radius_px)))
        camera = dataclasses.replace(small_camera(size, size), fill_factor=fill_factor)
        shot = Shot(scene, LENS, Exposure(0.001), camera, tolerance=float(rng.choice([0.03, 0.3, 1.0])))
        planned = measure(plan(shot), device)
        exact = exact_means(shot, planned)
        assert exact is not None and not planned.optics.accuracy.whole_pixels
        left = np.quantile(np.abs(z_scores_of_noise(run(planned, shot, device), exact.electrons, planned)), 0.999)
        ratios.append(left / planned.error_budget.predicted_sigma)
    assert 0.3 < max(ratios) <= 1.0


@pytest.mark.parametrize("scale", [0.3, 0.5, 0.7, 0.95])
def test_means_of_a_coarse_scene_leave_at_most_what_their_law_states(scale):
    """Random pixels, linear between their centres, in float64: the mean over photosite and circle against sums of samples."""
    size, parts = 60, 12
    pixels = round(size * scale) + 2
    picture = np.random.default_rng(1).random((pixels, pixels))
    places = scale * (np.arange(size * parts) + 0.5) / parts - 0.5
    fine = map_coordinates(picture, np.meshgrid(places, places, indexing="ij"), order=1, mode="nearest")

    def photosites(light):
        return light.reshape(size, parts, size, parts).mean(axis=(1, 3))

    second = np.maximum(np.abs(np.diff(picture, 2, axis=0))[:, 1:-1], np.abs(np.diff(picture, 2, axis=1))[1:-1])
    curvature, inner = scale * np.quantile(second, 0.999), (slice(8, -8), slice(8, -8))
    for radius_px in (0.2, 0.5, 0.7, 1.0, 2.0, 4.0):
        truth = photosites(fftconvolve(fine, disk_weights(parts * radius_px), mode="same"))
        found = fftconvolve(photosites(fine), disk_weights(radius_px), mode="same")
        left = np.quantile(np.abs(found - truth)[inner], 0.999)
        assert left <= curvature * twice_blurred_share(radius_px, scale) / 12.0


@pytest.mark.parametrize("share", [0.02, 0.5])
@pytest.mark.parametrize("radius_px", [0.8, 1.1, 1.6, 2.1])
def test_light_between_pixels_states_what_means_over_photosites_leave(radius_px, share):
    """Bright pixels over black, two photosites each, in float64 as above: found in the noise of the light that is there."""
    parts, scale, size = 12, 0.5, 48
    rng = np.random.default_rng(2)
    picture = np.where(rng.random((24, 24)) < share, 1.0, 2e-3 * rng.random((24, 24)))
    shot = Shot(band_scene(picture, float(depth_of(radius_px))), LENS, Exposure(0.001), small_camera(size, size))
    optics = plan(shot).optics
    accuracy, places = optics.accuracy, scale * (np.arange(-8 * parts, (size + 8) * parts) + 0.5) / parts - 0.5
    fine = map_coordinates(picture / picture.max(), np.meshgrid(places, places, indexing="ij"), order=1, mode="nearest")

    def photosites(light):
        return light.reshape(size + 16, parts, size + 16, parts).mean(axis=(1, 3))[8:-8, 8:-8]

    truth = photosites(fftconvolve(fine, disk_weights(parts * radius_px), mode="same"))
    means = fine.reshape(size + 16, parts, size + 16, parts).mean(axis=(1, 3))
    found = fftconvolve(means, disk_weights(radius_px), mode="same")[8:-8, 8:-8]
    noise_e = np.sqrt(accuracy.electrons * truth + accuracy.read_noise_e**2)
    left = np.quantile(np.abs(found - truth) * accuracy.electrons / noise_e, 0.999)
    stated = accuracy.in_sigma(optics.contrast.ends / 12.0)
    assert left < stated < 1.3 * left


@pytest.mark.slow
def test_squares_behind_a_kernel_from_a_file_take_samples_as_their_penumbrae_need(tmp_path):
    """Patches of 8 pixels to a photosite, 1 sigma allowed: one sample left 1.1 where 0.71 were stated (seed 6901, shot 163)."""
    budget = plan(load_shot(draw_shot(6901, 163).write(tmp_path))).error_budget
    (means,) = (term for term in budget.terms if "points per photosite" in term.cause)
    assert means.cause.startswith("means on 2 x 2") and 0.165 < budget.predicted_sigma < 1.0  # found with them


@pytest.mark.parametrize(("bar_px", "radius_px"), [(14, 1.38), (15, 0.8)])
def test_penumbrae_of_a_fine_scene_behind_diffraction_end_in_the_dark(bar_px, radius_px):
    """Bright bars over black, two pixels to a photosite, whose edges lie on its borders or in its middle, against float64."""
    parts, size = 8, 40
    picture = np.where((np.arange(2 * size) // bar_px % 2)[:, None] + np.zeros(2 * size) > 0, 1.0, 2e-3)
    scene = band_scene(picture, float(depth_of(radius_px)))
    shot = Shot(scene, dataclasses.replace(LENS, diffraction=True), Exposure(0.001), small_camera(size, size))
    optics = plan(shot).optics
    accuracy, defocus = optics.accuracy, optics.defocus
    (finest,) = defocus.samples_per_axis(np.array([radius_px]), np.array([radius_px])).tolist()
    fine = np.kron(picture / picture.max(), np.ones((parts // 2, parts // 2)))

    def means(light, count):
        return light.reshape(size * count, len(light) // (size * count), size * count, -1).mean(axis=(1, 3))

    truth = means(convolve(fine, disk_weights(parts * radius_px), mode="nearest"), 1)
    noise_e = np.sqrt(accuracy.electrons * truth + accuracy.read_noise_e**2)
    for count in (1, finest):
        found = means(convolve(means(fine, count), disk_weights(count * radius_px), mode="nearest"), 1)
        left = np.quantile(np.abs(found - truth) * accuracy.electrons / noise_e, 0.999)
        stated = accuracy.in_sigma(optics.contrast.ends / (12.0 * count**2))
        assert accuracy.in_sigma(grid_error(radius_px, count, 2.0)) < left < stated < 10.0 * left


def test_penumbrae_of_a_layer_before_one_in_focus_end_in_the_dark(tmp_path):
    """The audit found 0.49 sigma, standard error 0.015, where a layer ends in the dark; 0.21 were told (seed 3001, shot 38)."""
    assert plan(load_shot(draw_shot(3001, 38).write(tmp_path))).error_budget.predicted_sigma > 0.49 - 3.3 * 0.015


@pytest.mark.parametrize(("fill_factor", "found"), [(0.8, 0.344), (0.64, 0.46), (0.5, 0.402)])
def test_samples_that_the_open_side_cuts_are_seen_over_all_of_their_width(fill_factor, found, tmp_path):
    """Patches of 4 pixels per photosite on a tilted wall: 0.22, 0.20 and 0.18 sigma were told where rays found more."""
    shot = load_shot(draw_shot(6301, 87).write(tmp_path), {"camera.fill_factor": fill_factor})
    assert plan(shot).error_budget.predicted_sigma > found - 3.3 * 0.02


def test_a_lamp_of_coarse_pixels_states_the_end_of_its_spot(tmp_path):
    """The audit found 4.2 sigma in the dark where 2.5 were stated (seed 51, shot 62)."""
    budget = plan(load_shot(draw_shot(51, 62).write(tmp_path))).error_budget
    assert budget.is_clamped and 4.2 < budget.predicted_sigma < 42.0


def test_lamps_over_black_are_bounded_by_the_noise_of_the_dark(tmp_path):
    """Steps in depth, lamps of up to 10^7 e- and no wall: the audit found 63 sigma at a rim (seed 10, shot 3)."""
    budget = plan(load_shot(draw_shot(10, 3).write(tmp_path))).error_budget
    assert budget.is_clamped and 64.0 < budget.predicted_sigma < 640.0
    (warning, *_) = budget.warnings()
    assert "edges of the spots of lamps" in warning


def test_a_slope_ends_at_the_border_of_the_scene():
    """Beyond it the light goes on as it ends, so that the second difference there is the slope; inside there is none."""
    rows = 64
    ramp = np.repeat(1.0 + (np.arange(rows) + 0.5)[:, None] / rows, 48, axis=1)
    scene = band_scene(ramp, np.asarray(depth_of(np.full(ramp.shape, 2.0) + ramp)))
    contrast = plan(Shot(scene, LENS, Exposure(0.001), small_camera(48, rows))).optics.contrast
    slope = 0.5 / rows  # of the brightest light
    assert contrast.texture < 1e-4 < slope < contrast.curvature < 2.0 * slope  # more in the dark, whose noise is less


def test_a_slope_that_moves_states_its_border(tmp_path):
    """A curved surface that a camera passes sideways: the audit found 0.074 sigma in its first row (seed 31, shot 23)."""
    budget = plan(load_shot(draw_shot(31, 23).write(tmp_path))).error_budget
    assert budget.is_clamped and 0.074 < budget.predicted_sigma < 0.74
    assert "samples beside the border of the scene" in budget.warnings()[0]


def test_circles_between_tabulated_radii_count_in_the_dark(tmp_path):
    """A curved surface of hard edges through the focus: the audit found 1.3 sigma beside them (seed 31, shot 29)."""
    budget = plan(load_shot(draw_shot(31, 29).write(tmp_path))).error_budget
    assert budget.is_clamped and 1.3 < budget.predicted_sigma < 13.0
    assert any("radii that are tabulated" in term.cause for term in budget.terms)


@pytest.mark.parametrize("share", [0.02, 0.5])
@pytest.mark.parametrize("middle_px", [0.56, 0.78, 1.31, 3.25])
def test_circles_between_tabulated_radii_keep_to_their_law(middle_px, share, device):
    """Random pixels, one to a photosite, of a hardly tilted surface, against exact areas of each photosite's own disk."""
    side = 48
    radii = middle_px + 0.04 * ((np.arange(side) + 0.5) / side - 0.5)
    picture = np.where(np.random.default_rng(4).random((side, side)) < share, 1.0, 0.02)
    scene = band_scene(picture, np.asarray(depth_of(np.tile(radii, (side, 1)))))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(side, side))
    planned = measure(plan(shot), device)
    every = np.stack([convolve(picture, disk_weights(radius_px), mode="nearest") for radius_px in radii])
    truth = planned.optics.accuracy.electrons * np.moveaxis(every, 0, 2)[:, np.arange(side), np.arange(side)]
    z = np.abs(z_scores_of_noise(run(planned, shot, device), truth, planned))
    stated = sum(term.sigma for term in planned.error_budget.terms if "radii that are" in term.cause or "slopes" in term.cause)
    assert np.quantile(z, 0.999) <= stated


@pytest.mark.parametrize(("scale", "middle_px"), [(4, 0.3), (2, 0.56), (2, 2.3), (4, 2.25)])
def test_circles_between_tabulated_radii_of_squares_keep_to_their_law(scale, middle_px, device):
    """Random squares of a hardly tilted surface, black and white, by the exact weights of each photosite's own circle."""
    side = 32
    columns = (np.arange(side * scale) + 0.5) / (side * scale)
    picture = np.where(np.random.default_rng(4).random((side * scale, side * scale)) < 0.5, 1.0, 0.02)
    scene = band_scene(picture, np.asarray(depth_of(np.tile(middle_px + 0.04 * (columns - 0.5), (side * scale, 1)))))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(side, side))
    planned = measure(plan(shot), device)
    truth, middles = np.zeros((side, side)), scale * np.arange(side) + scale // 2
    for column in range(side):
        radius_px = middle_px + 0.04 * ((column + 0.5) / side - 0.5)
        weights = disk_square_weights(radius_px, scale)
        beside = (len(weights) - scale) // 2
        seen = np.pad(picture, beside, "edge")[:, scale * column : scale * column + len(weights)]
        truth[:, column] = [(seen[top : top + len(weights)] * weights).sum() for top in middles - scale // 2]
    z = np.abs(z_scores_of_noise(run(planned, shot, device), planned.optics.accuracy.electrons * truth, planned))
    stated = planned.error_budget.predicted_sigma
    assert 0.05 * stated < np.quantile(z, 0.999) <= stated


def test_even_light_is_sampled_without_error():
    """Two pixels to a photosite, which samples do not divide behind a lens that distorts."""
    lens = dataclasses.replace(LENS, distortion=Distortion(k1=0.05))
    scenes = [band_scene(light, float(depth_of(1.5))) for light in (np.full((48, 48), 0.5), np.indices((48, 48)).sum(0) % 2)]
    even, noisy = (plan(Shot(scene, lens, Exposure(0.001), small_camera(24, 24))) for scene in scenes)
    assert even.error_budget.predicted_sigma == 0.0 < noisy.error_budget.predicted_sigma


@pytest.mark.parametrize("radius_px", [0.25, 1.3])
def test_one_pixel_to_a_photosite_is_weighed_exactly(radius_px, device):
    """Noise, as areas of the circle in pixels; behind a lens that distorts photosites mix pixels, and have an error."""
    picture = np.random.default_rng(5).random((40, 40))
    scene = band_scene(picture, float(depth_of(radius_px)))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(40, 40))
    planned = measure(plan(shot), device)
    truth = convolve(picture, disk_weights(radius_px), mode="nearest") * planned.optics.accuracy.electrons_per_radiance
    truth *= run(planned, shot, device).mean() / truth.mean()
    assert planned.error_budget.predicted_sigma == 0.0
    assert np.abs(z_scores_of_noise(run(planned, shot, device), truth, planned)).max() < 1e-2
    distorted = dataclasses.replace(shot, lens=dataclasses.replace(LENS, distortion=Distortion(k1=0.05)))
    assert plan(distorted).error_budget.predicted_sigma > 0.1


@pytest.mark.parametrize("radius_px", [0.55, 0.65, 0.7, 1.0, 2.0, 5.0])
@pytest.mark.parametrize("side_px", [1, 4])
def test_one_circle_for_several_radii_keeps_to_what_is_allowed(radius_px, side_px):
    """Of a scene of one pixel per photosite: random squares, in areas of two circles, in float64."""
    accuracy = Accuracy(pixel_detail=1.0)
    grows_px = float(accuracy.same_px_at(np.array(radius_px)))
    assert grows_px < accuracy.same_px
    squares = np.kron((np.random.default_rng(3).random((200 // side_px,) * 2) > 0.5) * 1.0, np.ones((side_px, side_px)))
    one, other = (fftconvolve(squares, disk_weights(radius), mode="same") for radius in (radius_px, radius_px + grows_px))
    left = np.abs(one - other)[12:-12, 12:-12]
    assert 0.1 * accuracy.allowed < np.quantile(left, 0.999) <= accuracy.allowed


def test_radii_that_show_edges_do_not_share_a_circle(device):
    """A slightly tilted plane of random pixels, against areas of its circle in each photosite."""
    rows, columns = 24, 192
    picture, radii = np.random.default_rng(5).random((rows, columns)) ** 4, np.linspace(0.64, 0.72, columns)
    depth_m = np.broadcast_to(depth_of(radii).astype(np.float32), picture.shape)
    shot = Shot(band_scene(picture, depth_m), LENS, Exposure(0.0001), small_camera(columns, rows))
    planned = measure(plan(shot), device)
    weighed = [convolve(picture, disk_weights(radius), mode="nearest")[:, number] for number, radius in enumerate(radii)]
    truth = np.stack(weighed, axis=1) * planned.optics.accuracy.electrons_per_radiance
    truth *= run(planned, shot, device).mean() / truth.mean()
    assert np.quantile(np.abs(z_scores_of_noise(run(planned, shot, device), truth, planned)), 0.999) < 0.2


@pytest.mark.parametrize("radius_px", [0.45, 0.6, 0.98, 1.5, 3.0])
def test_even_squares_leave_what_is_told_of_light_between_pixels(radius_px):
    """Random pixels, one per photosite: light is linear between them, and weighed as if each was even.

    At the pixels' middles, and half a pixel aside of them.
    """
    parts, side = 24, 40
    light = np.random.default_rng(7).random((side, side)) ** 3
    planned = plan(Shot(band_scene(light, float(depth_of(radius_px))), LENS, Exposure(0.001), small_camera(side, side)))
    accuracy, contrast = planned.optics.accuracy, planned.optics.contrast
    places = (np.arange((side + 1) * parts + 1)) / parts - 0.5
    y, x = np.meshgrid(places, places, indexing="ij")
    between = map_coordinates(light, (y, x), order=1, mode="nearest")
    true = fftconvolve(between, disk_weights(parts * radius_px), mode="same")
    per_e, left = accuracy.electrons / np.sort(light, axis=None)[-2], []
    for down, right in ((0, 0), (0, 1), (1, 0), (1, 1)):
        seen, exact = (one[parts // 2 * (1 + down) :: parts, parts // 2 * (1 + right) :: parts] for one in (between, true))
        off = per_e * np.abs(exact - convolve(seen, disk_weights(radius_px), mode="nearest"))
        left.append(np.quantile((off / np.sqrt(per_e * exact + accuracy.read_noise_e**2))[5:-6, 5:-6], 0.999))
    for stated, found in ((contrast.ends, left[0]), (contrast.ends_aside, max(left))):
        assert 0.8 * accuracy.in_sigma(stated / 12.0) < found <= 1.05 * accuracy.in_sigma(stated / 12.0)


@pytest.mark.parametrize(("seed", "number"), [(98, 146), (203, 1)])
def test_small_circles_over_noise_and_edges_are_computed(seed, number, tmp_path):
    """Diffraction, and a pan, a pixel per photosite: the audit found 0.55 sigma where 0.29 were told, and 1.1 where 0.33."""
    planned = plan(load_shot(draw_shot(seed, number).write(tmp_path)))
    assert planned.optics.ignored_px == 0.0 and planned.error_budget.predicted_sigma <= planned.error_budget.tolerance


def test_layers_composited_before_light_between_their_pixels_have_a_term(device):
    """Holes in a layer before lamps, two photosites to a pixel, against rays through light and coverage in float64."""
    scale, side, parts = 0.5, 32, 8
    rng = np.random.default_rng(7)
    cover, light = (rng.random((16, 16)) < 0.7).astype(np.float32), np.where(rng.random((16, 16)) < 0.1, 1.0, 1e-3)
    scene = band_scene(0.01 * cover, 2.0, coverage=cover, behind=(Layer(light[..., None].astype(np.float32), 2.0001),))
    shot = Shot(scene, LENS, Exposure(0.001), small_camera(side, side))
    planned = measure(plan(shot), device)
    places = scale * (np.arange(side * parts) + 0.5) / parts - 0.5
    grid = np.meshgrid(places, places, indexing="ij")
    front, covered, back = (map_coordinates(one, grid, order=1, mode="nearest") for one in (0.01 * cover, cover, light))
    seen = (front + (1.0 - covered) * back).reshape(side, parts, side, parts).mean(axis=(1, 3))
    brightest = (0.01 * cover + (1.0 - cover) * light).max()
    truth = planned.optics.accuracy.electrons / brightest * seen
    z = np.quantile(np.abs(z_scores_of_noise(run(planned, shot, device), truth, planned)), 0.999)
    term = next(term for term in planned.error_budget.terms if "between their pixels" in term.cause)
    assert planned.error_budget.is_clamped and 0.2 * term.sigma < z <= term.sigma


def test_rims_of_lamps_count_in_the_noise_of_what_is_around_them():
    """What is around them is bright enough for `spot_error` up to 4,400 times that, but for light that any photosite sees."""
    wall, black = Accuracy(electrons=2000.0), Accuracy(electrons=1.0)
    assert rim_error(100.0, wall) == 0.0 < spot_error(100.0) < rim_error(100.0, black)
    assert rim_error(100.0, wall, 0.02, held=SPOT) > spot_error(100.0, 0.02) > rim_error(80.0, wall, 0.02, held=SPOT) == 0.0
    assert rim_error(80.0, wall, 0.02, beyond=0.1) == pytest.approx(8.0 * (2004.0 / 44.0) ** 0.5)
