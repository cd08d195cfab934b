"""The reference blur against closed forms and ray-traced pictures, and its error against the number of rays."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.lens_error import EXPOSURES_E, statistics, z_scores
from helpers.lens_truths import Case, makers, penumbra, point, sinusoid, slanted_plane, square_light
from helpers.randomness import accept
from scipy import stats

from simulator.errors import PhotositeError
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.layered_rays import needed_iterations, ray_samples, sample_lens, upload_surfaces
from simulator.sensor.camera.camera import Window

FINE = 8  # samples per photosite, so that surfaces are known better than the blur is asked to be
LIT = [make for make in makers(FINE) if make.func not in (point, square_light)]  # few rays meet a small light


def picture(device, case: Case, samples: int, **settings) -> np.ndarray:
    surfaces = upload_surfaces(device, case.colour[:, None], case.coverage, case.radius_px, case.margin, case.oversampling)
    return taken(device, surfaces, ray_samples(samples), Window(0, 0, *case.truth.shape[::-1]), **settings)


def taken(device, surfaces, points, frame, **settings) -> np.ndarray:
    light = sample_lens(device, surfaces, points, frame, **settings)
    return device.download(light, (light.size // (4 * frame.height * frame.width), frame.height, frame.width), np.float32)[0]


def told(make) -> str:
    """Name of what makes a scene, with its numbers."""
    return "_".join([make.func.__name__, *map(str, make.args)])


@pytest.mark.parametrize("make", LIT, ids=told)
def test_closed_forms_are_met_with_a_thousand_rays(device, make):
    case = make()
    found = statistics(z_scores(picture(device, case, 1024), case.truth, 2000.0))
    assert found.rms < 0.15 and found.p99 < 0.4


@pytest.mark.slow
@pytest.mark.parametrize("make", LIT, ids=told)
def test_closed_forms_are_met_below_a_tenth_of_the_noise(device, make):
    case = make()
    light = picture(device, case, 2**17)
    for electrons in EXPOSURES_E:
        found = statistics(z_scores(light, case.truth, electrons))
        assert found.p99_9 < 0.1 and abs(found.mean) < 0.02


def errors(device, case: Case, powers) -> np.ndarray:
    """Root mean square of the error for 2^power samples."""
    return np.array([np.sqrt(np.mean((picture(device, case, 2**power) - case.truth) ** 2)) for power in powers])


@pytest.mark.parametrize(
    ("scene", "numbers", "steepest"),
    [(sinusoid, (7.6, 24.0, 16), -0.85), (penumbra, (-11.0, 0.0, 8), -0.6), (square_light, (7.6,), -0.55)],
)
def test_the_error_falls_faster_than_of_random_points(device, scene, numbers, steepest):
    """Independent points fall with the power -1/2; Sobol' points do better, the more so the smoother the scene."""
    powers = np.arange(6, 14)
    assert stats.linregress(powers, np.log2(errors(device, scene(*numbers), powers))).slope < steepest


@pytest.mark.parametrize(("cells", "power"), [(True, 1), (False, 2)])
@pytest.mark.parametrize("oversampling", [1, 2, 4])
def test_surfaces_on_a_coarse_grid_lose_contrast_twice(device, oversampling, cells, power):
    """A wave read from samples 1/n photosites wide: sinc(q / n) once more as cells, its square when bilinear, per axis.

    docs/lens_accuracy.md names this as the cause of what was wrong on slanted surfaces.
    """
    case = sinusoid(3.3, 9.0, oversampling)
    found = picture(device, case, 2**13, cells=cells).ravel() - 0.5
    wave = case.truth.ravel() - 0.5
    contrast = float(found @ wave / (wave @ wave))
    lost = np.sinc(0.6 / 9.0 / oversampling) * np.sinc(0.8 / 9.0 / oversampling)
    assert contrast == pytest.approx(lost**power, abs=7e-4)  # waves on one sample per photosite have aliases


@pytest.mark.parametrize("samples", [1, 333, 20000])
def test_a_flat_field_stays_flat(device, samples):
    """Any radius, tilt or number of rays: uniform light stays what it is."""
    rng = np.random.default_rng(3)
    radius = np.stack([np.linspace(-9.0, 3.0, 60)[None, :] + np.linspace(0.0, 4.0, 40)[:, None], np.full((40, 60), 5.0)])
    coverage = np.stack([rng.random((40, 60)), np.ones((40, 60))])
    surfaces = upload_surfaces(device, (0.7 * coverage)[:, None], coverage, radius, 12)
    found = taken(device, surfaces, ray_samples(samples, patterns=2), Window(0, 0, 9, 4))
    assert np.max(np.abs(found / 0.7 - 1.0)) < 1e-6


def coloured_scene(rng, tilt=0.05):
    """Two layers of three colours around a frame of 30 x 20 photosites, margin 6."""
    colour = rng.random((2, 3, 32, 42))
    coverage = np.stack([(rng.random((32, 42)) > 0.5).astype(float), np.ones((32, 42))])
    colour[0] *= coverage[0]
    radius = np.stack([-3.0 + tilt * np.arange(42)[None, :] + np.zeros((32, 1)), np.full((32, 42), 4.0)])
    return colour, coverage, radius


def test_a_crop_has_the_bits_of_the_whole_frame(device):
    colour, coverage, radius = coloured_scene(np.random.default_rng(4))
    points = ray_samples(100)
    surfaces = upload_surfaces(device, colour, coverage, radius, 6)
    whole = taken(device, surfaces, points, Window(101, 57, 30, 20), cfa=((0, 1), (1, 2)))
    y, x, height, width = 4, 6, 9, 13
    parts = (array[..., y : y + height + 12, x : x + width + 12] for array in (colour, coverage, radius))
    crop = upload_surfaces(device, *parts, 6, iterations=surfaces.iterations)
    found = taken(device, crop, points, Window(101 + x, 57 + y, width, height), cfa=((0, 1), (1, 2)))
    assert np.array_equal(found, whole[y : y + height, x : x + width])


def test_a_mosaic_is_its_own_colours_of_the_whole(device):
    surfaces = upload_surfaces(device, *coloured_scene(np.random.default_rng(5)), 6)
    frame, points = Window(0, 0, 30, 20), ray_samples(64)
    planes = device.download(sample_lens(device, surfaces, points, frame), (3, 20, 30), np.float32)
    mosaic = taken(device, surfaces, points, frame, cfa=((1, 0), (2, 1)))
    for y, x, plane in ((0, 0, 1), (0, 1, 0), (1, 0, 2), (1, 1, 1)):
        assert np.array_equal(mosaic[y::2, x::2], planes[plane, y::2, x::2])


def test_an_occluder_in_focus_hides_what_is_behind(device):
    near = np.zeros((30, 40))
    near[:, :20] = 1.0
    colour = np.stack([0.0 * near, np.ones((30, 40))])[:, None]
    surfaces = upload_surfaces(device, colour, np.stack([near, 0 * near + 1.0]), np.stack([0.0 * near, 0.0 * near + 5.0]), 6)
    found = taken(device, surfaces, ray_samples(256), Window(0, 0, 28, 18))
    assert np.all(found[:, :14] == 0.0) and np.allclose(found[:, 14:], 1.0, rtol=1e-6)


def test_points_fill_photosite_and_pupil_evenly():
    points = ray_samples(1, patterns=1000).reshape(-1, 4).astype(float)
    x, y = points[:, 2], points[:, 3]
    uniform = [points[:, 1], points[:, 0], x**2 + y**2, (np.arctan2(y, x) / (2.0 * math.pi)) % 1.0]
    accept({number: float(stats.kstest(sample, "uniform").pvalue) for number, sample in enumerate(uniform)})


@pytest.mark.parametrize("blades", [3, 5, 6, 9])
def test_points_of_a_bladed_pupil_fill_the_polygon(blades):
    """Second moment of a regular polygon of circumradius 1: (2 + cos(2 pi / n)) / 6; no point outside its edges."""
    pupil = Pupil(blades, rotation_deg=17.0)
    points = ray_samples(2**12, patterns=8, pupil=pupil)[..., 2:].reshape(-1, 2).astype(float) / pupil.corner_radius
    assert np.mean(np.sum(points**2, axis=1)) == pytest.approx((2.0 + math.cos(2.0 * math.pi / blades)) / 6.0, rel=1e-3)
    assert np.allclose(points.mean(axis=0), 0.0, atol=1e-3)
    middles = math.radians(17.0) + (2.0 * np.arange(blades) + 1.0) * math.pi / blades
    distance = points @ np.stack([np.cos(middles), np.sin(middles)])
    reach = distance.max(axis=0)
    assert np.all(reach < math.cos(math.pi / blades) + 1e-6) and np.all(reach > 0.98 * math.cos(math.pi / blades))


def test_steps_reach_the_surface(device):
    """More steps than planned change nothing that a bright frame shows; none at all do."""
    case = slanted_plane((0.05, 0.11), 2)
    planned = needed_iterations(case.radius_px, case.oversampling)
    window, points = Window(0, 0, *case.truth.shape[::-1]), ray_samples(64)
    light = {}
    for steps in (0, planned, 3 * planned):
        surfaces = upload_surfaces(device, case.colour[:, None], case.coverage, case.radius_px, case.margin, 2, steps)
        light[steps] = taken(device, surfaces, points, window).astype(float)
    assert statistics(z_scores(light[planned], light[3 * planned], 20000.0)).p99_9 < 0.1
    assert statistics(z_scores(light[0], light[3 * planned], 20000.0)).p99 > 1.0


def test_flat_layers_need_no_steps():
    assert needed_iterations(np.full((2, 8, 8), 3.0)) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c, a, r: (c * np.nan, a, r), "surface colour = NaN"),
        (lambda c, a, r: (c, a, r + np.inf), "surface radius = NaN"),
        (lambda c, a, r: (c, a + 0.1, r), "surface coverage = 0.1 to 1.1"),
        (lambda c, a, r: (c, a[:1], r), "surfaces = colour"),
        (lambda c, a, r: (c, a, r + 3.0 * (np.arange(42) > 20)), "as two layers"),
    ],
)
def test_surfaces_that_cannot_be_are_refused(device, change, message):
    with pytest.raises(PhotositeError, match=message):
        upload_surfaces(device, *change(*coloured_scene(np.random.default_rng(6))), 6)


def test_a_grid_that_ends_inside_the_margin_is_refused(device):
    surfaces = upload_surfaces(device, *coloured_scene(np.random.default_rng(6)), 6)
    with pytest.raises(PhotositeError, match=r"give \(32, 44\): the frame and its margin"):
        sample_lens(device, surfaces, ray_samples(4), Window(0, 0, 32, 20))


RENDERS = Path(__file__).parents[4] / "shared" / "data" / "mitsuba"


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "radii"), [("near_occluder", (-11.089522, 0.0)), ("both_defocused", (-5.118241, 5.971281))])
def test_a_ray_tracer_gives_the_same_picture(device, scene, radii):
    """Mitsuba 3's thin lens, two planes: no photosite off by a sigma, hardly more deviation than the render's own noise.

    The layers are known to one photosite and with noise of their own, hence 1.25 times; finer ones: test_lens_mitsuba.py.
    """
    path = RENDERS / f"{scene}.npz"
    if not path.is_file():
        pytest.skip(f"{path} is not there: Mitsuba's pictures are no part of the repository")
    render = np.load(path)
    colour, coverage = (np.stack([render[f"layer{k}_{what}"] for k in (1, 0)]) for what in ("rgb", "alpha"))
    radius = np.broadcast_to(np.array(radii)[:, None, None], coverage.shape)
    surfaces = upload_surfaces(device, colour[:, None], np.clip(coverage, 0.0, 1.0), radius, 48)
    points = ray_samples(4096)
    points[..., :2] = 0.5  # the layers were rendered as means over photosites: their area must not count twice
    light = taken(device, surfaces, points, Window(0, 0, 256, 256))
    plain = ~_near_highlights(colour, 12)
    own = statistics((z_scores(render["thinlens_b"], render["thinlens_a"], 2000.0) / 2.0), plain)
    found = statistics(z_scores(light, render["thinlens"], 2000.0), plain)
    assert found.above_1 == 0.0 and found.p99 < 1.25 * own.p99 and abs(found.mean) < 0.01


def _near_highlights(colour, reach) -> np.ndarray:
    """Photosites that the blur of a texel above radiance 2 may touch: there the render itself is too noisy."""
    from scipy.ndimage import maximum_filter

    return maximum_filter((colour > 2.0).any(axis=0), 2 * reach + 1)[48:-48, 48:-48]
