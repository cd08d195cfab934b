"""The truth of the audit: in float64 where that knows a shot, and rays of the reference path, which agree."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from audit import shot_truth
from audit.drawn_shots import draw_shot
from audit.float64_truth import exact_means, is_simple, lamp_limit, means_with_lamps, sum_rays
from audit.seen_places import SeenPlaces
from audit.shot_truth import (
    find_truth,
    noise_electrons,
    rays_error,
    run,
    true_electrons,
    wanted_error,
    with_finer_samples,
    z_scores,
)
from audit.timed_rays import with_timed_rays
from helpers.area_truth import photosite_means
from helpers.audit_shots import BRIGHT, DIM, simple_shot
from scipy.ndimage import map_coordinates

from simulator.config import load_shot
from simulator.optics.defocus.lamp_images import square_image
from simulator.optics.error_term import WINGS
from simulator.pipeline.planner import measure, plan
from simulator.sensor.camera.cfa import Cfa


def test_the_float64_sum_has_the_closed_form_within_its_error(tmp_path):
    """Of rays, against `area_truth`, which cuts the aperture's disk into chords."""
    shot = simple_shot(tmp_path)
    planned = plan(shot)
    exact, summed = exact_means(shot, planned), sum_rays(shot, planned, sets=4, points=1024)
    assert is_simple(shot, planned) and exact is not None
    z = (summed.electrons - exact.electrons) / np.maximum(summed.error, 1e-3)
    assert 0.5 < np.sqrt(np.mean(z**2)) < 3.0  # Student's t of three degrees of freedom


def test_wings_of_diffraction_that_a_truth_shares_do_not_count_as_its_error(tmp_path, device):
    """A bright and a dark half in focus, where the reference has no other error."""
    light = np.where(np.arange(40) < 20, 1.0, 0.01) * np.ones((32, 1))
    lens = {"focal_length": "50 mm", "f_number": "f/16", "focus_distance": "1.97 m", "diffraction": True}
    shot = simple_shot(tmp_path, lens=lens, camera={"base": "ideal", "width": 40, "height": 32})
    np.save(tmp_path / "light.npy", light.astype(np.float32))
    reference = plan(dataclasses.replace(shot, tolerance=0.0)).error_budget
    assert reference.sigma_of(WINGS) == pytest.approx(reference.predicted_sigma) and reference.predicted_sigma > 0.02
    _, sigma = true_electrons(shot, device, 0.01)
    assert sigma < 1e-6


BLADES = {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m", "aperture": {"blades": 5, "rotation": "20 deg"}}
KNOWN = {
    "distortion": {"lens": {**BLADES, "distortion": {"k1": -0.08, "unit": "half_diagonal"}}},
    "distortion of a pixel per photosite": {
        "lens": {**BLADES, "distortion": {"k1": -0.08, "unit": "half_diagonal"}},
        "camera": {"base": "ideal", "width": 40, "height": 32},
    },
    "pinhole": {
        "lens": {"pinhole": {"diameter": "0.02 mm", "distance": "20 mm", "diffraction": False}},
        "scene": {"image": "light.npy", "luminance": "20000 cd/m^2"},
    },
    "rolled": {"motion": {"camera": {"roll": "900 deg/s"}}},
    "rolling": {
        "motion": {"camera": {"pan": "9 deg/s", "roll": "300 deg/s"}},
        "exposure": {"time": "1/100 s", "iso": 100, "shutter": {"readout_time": "0.02 s"}},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KNOWN)
def test_float64_and_the_reference_path_agree(tmp_path, device, kind):
    """Blades, distortion, holes and turning cameras: neither has anything but the plan's geometry from the other."""
    scene = {"image": "light.npy", "luminance": "0.3 cd/m^2", "depth": "1.97 m"}
    shot = simple_shot(tmp_path, **{"scene": scene, **KNOWN[kind]})
    planned = plan(shot)
    summed = sum_rays(shot, planned, points=512)
    assert is_simple(shot, planned)
    own = np.quantile(summed.error / noise_electrons(summed.electrons, planned), 0.99)
    found, sigma = true_electrons(dataclasses.replace(shot, tolerance=0.3), device, wanted_error(0.3), 1.0)
    z = np.abs(z_scores(found, summed.electrons, planned))
    assert np.quantile(z, 0.99) < 3.3 * np.hypot(sigma, own) < 1.1  # light of other places differs by several


@pytest.mark.slow
def test_light_between_few_pixels_is_that_of_many_small_squares(tmp_path):
    """One pixel to two photosites, through a low-pass filter, whose light is read at 12 places to a pixel."""
    camera = {"base": "ideal", "width": 24, "height": 20, "pixel_pitch": "6 um", "low_pass": "3 um"}
    scene = {"image": "light.npy", "luminance": "20 cd/m^2", "depth": "1.9 m"}
    shot = simple_shot(tmp_path, camera=camera, scene=scene)
    np.save(tmp_path / "light.npy", np.random.default_rng(2).random((10, 12)).astype(np.float32))
    planned = plan(shot)
    found, per_pixel, beyond = exact_means(shot, planned), 12, 4
    assert is_simple(shot, planned) and found is not None and planned.optics.projection.scale == 0.5
    light = np.pad(np.load(tmp_path / "light.npy").astype(np.float64), beyond, "edge")
    rows, columns = ((np.arange(per_pixel * side) + 0.5) / per_pixel - 0.5 for side in light.shape)
    read = map_coordinates(light, np.meshgrid(rows, columns, indexing="ij"), order=1, mode="nearest")
    radius_px, scale = float(shot.lens.blur_radius_um(1.9)) / 6.0, 0.5 * per_pixel
    spots = itertools.product((-0.25, 0.25), repeat=2)  # of the filter [photosites]
    shape = tuple(2 * side for side in light.shape)
    means = [photosite_means(read, shape, radius_px, grid=(scale, scale * down, scale * right)) for down, right in spots]
    ratio = found.electrons / np.mean(means, axis=0)[2 * beyond : -2 * beyond, 2 * beyond : -2 * beyond]
    assert abs(radius_px) > 1.0 and np.ptp(ratio) < 2e-3 * ratio.mean()


def test_upright_photosites_are_integrated_exactly(tmp_path, monkeypatch):
    """Points in the pupil and in time alone leave less error than points in the area leave, around the same light."""
    shot = simple_shot(tmp_path, motion={"layers": {0: {"velocity": ["150 px/s", "-90 px/s"]}}})
    planned = plan(shot)
    exact = sum_rays(shot, planned, sets=4, points=128)
    monkeypatch.setattr(SeenPlaces, "is_upright", False)
    plain = sum_rays(shot, planned, sets=4, points=128)
    apart = np.abs(exact.electrons - plain.electrons) / np.hypot(exact.error, plain.error)
    assert np.median(exact.error) < 0.5 * np.median(plain.error) and 0.3 < np.median(apart) < 1.5


def test_a_hole_has_the_closed_form(tmp_path):
    pinhole = {"pinhole": {"diameter": "0.02 mm", "distance": "20 mm", "diffraction": False}}
    shot = simple_shot(tmp_path, lens=pinhole, scene={"image": "light.npy", "luminance": "20000 cd/m^2"})
    planned = plan(shot)
    exact, summed = exact_means(shot, planned), sum_rays(shot, planned, sets=4, points=128)
    assert is_simple(shot, planned) and exact is not None
    assert summed.electrons == pytest.approx(exact.electrons, rel=0.03) and np.ptp(exact.electrons) > 5.0


def test_rays_are_as_exact_as_the_error_that_the_reference_states_asks_for():
    assert rays_error(0.03, 0.02, np.inf) == rays_error(0.03, 0.0, 0.06) == 0.03
    assert np.hypot(rays_error(0.03, 0.055, 0.06), 0.055) == pytest.approx(0.98 * 0.06)
    assert rays_error(0.03, 0.07, 0.06) == 0.03  # no rays help


@pytest.mark.parametrize(
    ("width", "height", "exposure"),
    [(16, 12, DIM), *(pytest.param(*size, BRIGHT, marks=pytest.mark.slow) for size in ((16, 12), (20, 16), (13, 10)))],
)
def test_the_reference_path_has_the_closed_form_at_any_scale(tmp_path, device, width, height, exposure):
    """2.5, 2 and 3 pixels per photosite: the rays' grid divides the pixels, or is fine."""
    shot = simple_shot(tmp_path, camera={"base": "ideal", "width": width, "height": height}, exposure=exposure)
    planned = plan(shot)
    summed = exact_means(shot, planned) or sum_rays(shot, planned, points=1024)
    own = np.quantile(summed.error / noise_electrons(summed.electrons, planned), 0.99)
    found, sigma = true_electrons(dataclasses.replace(shot, tolerance=0.1), device, wanted_error(0.1))
    z = np.abs(z_scores(found, summed.electrons, planned))
    assert np.quantile(z, 0.99) < 3.3 * np.hypot(sigma, own)


def test_rows_open_at_their_own_times_only_where_a_shutter_rolls(tmp_path):
    """A camera states how long its read-out takes, whatever shutter a shot has."""
    moving = {"motion": {"layers": {0: {"velocity": ["150 px/s", "-90 px/s"]}}}}
    camera = {"base": "sony_a7_iii", "width": 20, "height": 16}
    found = []
    for shutter in ({}, {"shutter": {"scan_order": "top_to_bottom"}}, {"shutter": {"readout_time": "0.02 s"}}):
        shot = simple_shot(tmp_path, camera=camera, exposure=BRIGHT | shutter, **moving)
        found.append(SeenPlaces.of(shot, plan(shot)).opened_s)
    assert (found[0] == 0.0).all()
    assert np.diff(found[1]) == pytest.approx(0.06233 / 16) and np.diff(found[2]) == pytest.approx(0.02 / 16)


def turning_layers(tmp_path, **settings):
    """Shot of two layers with a photosite for each pixel, nearly in focus, that turn before the camera."""
    rng = np.random.default_rng(4)
    for number in range(2):
        np.save(tmp_path / f"light_{number}.npy", rng.random((16, 20)).astype(np.float32))
    np.save(tmp_path / "alpha.npy", (rng.random((16, 20)) < 0.5).astype(np.float32))
    layers = [
        {"image": "light_0.npy", "depth": "1.992 m", "alpha_image": "alpha.npy"},
        {"image": "light_1.npy", "depth": "2.006 m"},
    ]
    rolled = {"camera": {"roll": "900 deg/s"}}
    return simple_shot(tmp_path, scene={"layers": layers, "luminance": "3 cd/m^2"}, motion=rolled, **settings)


def test_rays_leave_no_covariance_at_edges_of_layers_that_turn(tmp_path):
    """They meet one layer after the other: nothing of it is stated where samples divide the pixels, and the rest is."""
    shots = turning_layers(tmp_path), turning_layers(tmp_path, camera={"base": "ideal", "width": 7, "height": 5})
    even, crossed = (plan(dataclasses.replace(shot, tolerance=0.0)) for shot in shots)
    assert all(one.optics.motion is not None and one.optics.motion.method == "joint" for one in (even, crossed))
    assert even.error_budget.sigma_of("motion blur") == 0.0 < crossed.error_budget.sigma_of("motion blur")


@pytest.mark.slow
def test_rays_and_float64_agree_on_layers_that_turn(tmp_path, device):
    shot = turning_layers(tmp_path)
    planned = plan(shot)
    summed = sum_rays(shot, planned, points=2048)
    own = np.quantile(summed.error / noise_electrons(summed.electrons, planned), 0.999)
    found, sigma = true_electrons(dataclasses.replace(shot, tolerance=0.1), device, wanted_error(0.1))
    z = np.abs(z_scores(found, summed.electrons, planned))
    assert np.quantile(z, 0.999) < 3.3 * np.hypot(sigma, own) < 0.3


def test_rays_of_a_truth_meet_finer_samples_where_those_of_users_leave_too_much(tmp_path):
    """Samples of a distorted scene mix its pixels."""
    shot = simple_shot(tmp_path, lens=BLADES | {"distortion": {"k1": -0.08, "unit": "half_diagonal"}})
    reference = plan(dataclasses.replace(shot, tolerance=0.0))
    stated = reference.error_budget.predicted_sigma / 3.3
    assert with_finer_samples(reference, 10.0 * stated) is reference
    finer = with_finer_samples(reference, 0.5 * stated)
    assert finer.optics.accuracy.ray_samples == finer.optics.defocus.accuracy.ray_samples > 8
    assert finer.error_budget.predicted_sigma < 0.5 * reference.error_budget.predicted_sigma


def test_the_veil_of_a_truth_is_that_of_its_own_photosites(tmp_path, device):
    """By the definition, from the exact light of each colour at all photosites."""
    bare = {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m", "cos4": False}
    camera = {"base": "nikon_d850", "width": 20, "height": 16}
    exposure = {"time": "1/100 s", "iso": 100}
    plain, veiled = (
        simple_shot(tmp_path, lens=lens, camera=camera, exposure=exposure) for lens in (bare, bare | {"veiling_glare": 0.05})
    )
    planned = plan(veiled)
    images = []
    for channel in range(3):
        own = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, cfa=Cfa.uniform(channel)))
        images.append(exact_means(plain, own).electrons)
    y, x = np.mgrid[:16, :20]
    colours = np.array(planned.optics.cfa.planes)[y % 2, x % 2]
    expected = 0.95 * np.choose(colours, images) + 0.05 * np.array([image.mean() for image in images])[colours]
    found = find_truth(veiled, planned, 0.1, device)
    assert found.kind == "float64" and found.sigma == 0.0 and found.electrons == pytest.approx(expected, rel=1e-12)


def test_rays_of_a_truth_carry_instants_unless_lamps_send_their_own(tmp_path):
    """Of one surface behind a lens that blurs, which moves: images of instants all have the same rays."""
    reference = {"motion": {"camera": {"roll": "900 deg/s"}}, "tolerance": 0}
    shot = simple_shot(tmp_path, **reference)
    images = plan(shot)
    timed = with_timed_rays(images, shot)
    assert images.optics.motion.method == "instants" and timed.optics.motion.method == "joint"
    assert timed.error_budget.predicted_sigma < images.error_budget.predicted_sigma
    distorted = simple_shot(tmp_path, lens=BLADES | {"distortion": {"k1": -0.08, "unit": "half_diagonal"}}, **reference)
    assert with_timed_rays(plan(distorted), distorted).optics.motion.method == "instants"
    light = np.full((32, 40), 0.1, np.float32)
    light[11, 17] = 1000.0
    np.save(tmp_path / "lamp.npy", light)
    lamp = simple_shot(tmp_path, scene={"image": "lamp.npy", "luminance": "1 cd/m^2", "depth": "1.97 m"}, **reference)
    assert with_timed_rays(plan(lamp), lamp).optics.motion.method == "instants"


@pytest.mark.parametrize(("errors", "taken"), [((1.0, 0.6, 0.3), 2), ((0.1, 0.02, 0.004), 3), ((0.001, 0.0, 0.0), 1)])
def test_sums_that_would_not_be_judged_are_left_to_rays(tmp_path, monkeypatch, errors, taken):
    shot, planned = simple_shot(tmp_path, tolerance=0.1), plan(simple_shot(tmp_path))
    counts = []

    def summed(shot, planned, points):
        counts.append(points)
        return points

    monkeypatch.setattr(shot_truth, "exact_means", lambda shot, planned: None)
    monkeypatch.setattr(shot_truth, "sum_rays", summed)
    monkeypatch.setattr(shot_truth, "largest_error", lambda summed, planned: errors[len(counts) - 1])
    shot_truth.summed_truth(shot, planned, wanted_error(0.1))
    assert len(counts) == taken


@pytest.mark.parametrize(("per_side", "radius_px", "left"), [(8, 5.9, 2e-4), (2, 20.1, 1e-4)])
def test_the_rim_of_a_lamp_out_of_focus_is_exact(per_side, radius_px, left):
    """One pixel of a fine scene, against its closed form; chords for even light leave 2e-3 of its spot."""
    photosites = 2 * math.ceil(radius_px) + 6
    light, middle = np.zeros((photosites * per_side,) * 2), photosites * per_side // 2
    light[middle + 3, middle - 2] = 1e6
    places = np.arange(photosites) + 0.5
    down, across = (places - (middle + one + 0.5) / per_side for one in (3, -2))
    exact = 1e6 * square_image(radius_px, 1.0 / per_side, 1.0, down, across)
    found = means_with_lamps(light, (photosites, photosites), radius_px, 1.0, lamp_limit(light))
    assert np.abs(found - exact).max() < left * exact.max()


@pytest.mark.slow
def test_a_lamp_goes_on_beyond_the_border(tmp_path, device):
    """As a row of them, which chords for even light had wrong by 3 % of the photosite (9701:155)."""
    shot = load_shot(draw_shot(9701, 155).write(tmp_path))
    planned = measure(plan(shot), device)
    truth = exact_means(shot, planned)
    assert truth is not None
    assert np.abs(z_scores(run(planned, shot, device), truth.electrons, planned)).max() < 0.03


def test_a_truth_stops_at_its_processor_time(tmp_path, device):
    """And says how far it came: fewer rays leave a larger error."""
    shot = dataclasses.replace(simple_shot(tmp_path, exposure=DIM), tolerance=0.1)
    wanted = wanted_error(shot.tolerance)
    few, coarse = true_electrons(shot, device, 0.1 * wanted, seconds=0.0)
    exact, fine = true_electrons(shot, device, wanted)
    assert wanted <= fine < coarse
    z = np.abs(z_scores(few, exact, plan(shot)))
    assert np.quantile(z, 0.99) < 3.3 * (coarse + fine)
