"""Maps of the truth twin against float64 NumPy: variance, depth, blur circle, and every colour at every photosite."""

import dataclasses
import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import band_scene
from scipy import stats

from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.execution import compute_truth_maps, expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.pipeline.truth_maps import variance_map
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.readout import read_mean_electrons
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.registry import STAGES

LENS = ThinLens(50.0, 2.0, 2.0, cos4=False)
RANDOM = np.random.default_rng(7)


def noisy_camera(width=200, height=150, cfa="RGGB", **changes):
    stages = changes.pop("stages", {"photon_shot_noise": ()})
    settings = dict(bit_depth=12, black_level_dn=128.0, iso_table={100: IsoSetting(0.8, 4.0)}, read_noise_after_gain_dn=2.0)
    built = {stem: STAGES[stem](*values) for stem, values in stages.items()}
    return small_camera(width, height, cfa, stages=built, **settings | changes)


def shot_of(planes, depth_m=math.inf, camera=None, time_s=0.01, truth=(), seed=3):
    return Shot(band_scene(planes, depth_m), LENS, Exposure(time_s), camera or noisy_camera(), Seeds(frame=seed), truth=truth)


def test_variance_is_the_sum_of_shot_read_and_rounding_noise():
    planes = RANDOM.uniform(0.0, 0.02, (30, 40, 3))
    raw = simulate(shot_of(planes, truth=("variance",)))
    expected = 0.8**2 * raw.mean_electrons.astype(float) + 4.0**2 + 1 / 12
    assert raw.noise_free_dn.max() < raw.white_level_dn - 300 and np.ptp(raw.mean_electrons) > 100
    np.testing.assert_allclose(raw.truth["variance"], expected, rtol=1e-5)
    assert raw.truth["variance"].dtype == np.float32


def test_near_the_white_level_variance_is_that_of_a_clipped_normal_number():
    planned = plan(shot_of(np.ones((4, 4, 3))))
    electrons = np.linspace(0.0, 8000.0, 600).reshape(20, 30).astype(np.float32)
    found = variance_map(planned.sensor, electrons)
    for mean_e, variance in zip(electrons.ravel()[::37], found.ravel()[::37], strict=True):
        mean, sigma = 128 + 0.8 * float(mean_e), math.sqrt(0.64 * float(mean_e) + 16 + 1 / 12)
        codes = np.linspace(mean - 10 * sigma, mean + 10 * sigma, 200_001)
        weights = stats.norm.pdf(codes, mean, sigma)
        held = np.clip(codes, 0, 4095)
        first = (weights @ held) / weights.sum()
        expected = (weights @ (held - first) ** 2) / weights.sum()
        assert variance == pytest.approx(expected, rel=2e-3, abs=1e-3)
    assert found.min() < 1e-6, "a saturated photosite has no noise"


def test_frames_scatter_with_the_variance_of_the_map_up_into_saturation():
    level = np.linspace(0.2, 1.6, 40) * 0.1
    shots = [shot_of(np.repeat(level[None, :, None], 30, 0), camera=noisy_camera(cfa="MONO"), seed=seed) for seed in range(30)]
    first = simulate(dataclasses.replace(shots[0], truth=("variance",)))
    saturated = (first.noise_free_dn == first.white_level_dn).mean()
    assert 0.05 < saturated < 0.6
    codes = np.stack([simulate(shot).dn for shot in shots]).astype(float)
    wanted = first.truth["variance"].astype(float)
    ok = wanted > 1.0
    ratio = codes.var(axis=0, ddof=1)[ok] / wanted[ok]
    accept({"mean": mean_p(ratio, 1.0, ratio.var())})


@pytest.mark.parametrize("mode", ["charge", "average"])
def test_variance_of_binned_frames_is_that_of_their_codes(mode):
    camera = noisy_camera(cfa="MONO", binning=Binning(2, mode))
    raw = simulate(shot_of(np.full((4, 4), 0.01), camera=camera, truth=("variance", "depth", "blur", "rgb")))
    assert {plane.shape[:2] for plane in raw.truth.values()} == {raw.dn.shape}
    residual = (raw.dn - raw.noise_free_dn.astype(float)) / np.sqrt(raw.truth["variance"].astype(float))
    accept({"variance": variance_p(residual, 1.0, 1 / 1000)})


@pytest.mark.parametrize("changes", [{}, {"f_number": 16.0, "diffraction": True}], ids=["ideal", "diffracting"])
def test_every_map_of_a_window_has_the_bits_of_the_whole_frame(changes):
    """The brightest photosite lies outside the window."""
    lens = dataclasses.replace(LENS, **changes)
    planes, depth_m = RANDOM.uniform(0.0, 0.02, (30, 40, 3)), RANDOM.uniform(2.0, 2.1, (30, 40))
    planes[:6] *= 5.0
    shot = dataclasses.replace(shot_of(planes, depth_m, truth=("variance", "depth", "blur", "rgb")), lens=lens)
    window = Window(40, 60, 100, 70)
    whole, part = simulate(shot), simulate(replace(shot, camera=replace(shot.camera, window=window)))
    inside = slice(window.y, window.y + window.height), slice(window.x, window.x + window.width)
    assert part.mean_electrons.max() < 0.5 * whole.mean_electrons.max()
    np.testing.assert_array_equal(part.mean_electrons, whole.mean_electrons[inside])
    for name, plane in part.truth.items():
        np.testing.assert_array_equal(plane, whole.truth[name][inside], err_msg=name)


def test_depth_is_the_scenes_at_the_pixels_centre_and_never_a_mean():
    depth_m = RANDOM.uniform(1.0, 9.0, (15, 20))
    depth_m[3, 4] = math.inf
    raw = simulate(shot_of(np.ones((15, 20)), depth_m, noisy_camera(cfa="MONO"), truth=("depth", "blur")))
    expected = np.repeat(np.repeat(depth_m, 10, axis=0), 10, axis=1)  # ten photosites per scene pixel
    np.testing.assert_array_equal(raw.truth["depth"], expected.astype(np.float32))
    pupil_m, image_m = 0.05 / 2.0, 1 / (1 / 0.05 - 1 / 2.0)
    in_focus_m = 1 / (1 / 0.05 - 1 / expected)  # thin lens equation: where the light of this depth meets
    radius_m = 0.5 * pupil_m * np.abs(image_m - in_focus_m) / in_focus_m  # similar triangles behind the lens
    np.testing.assert_allclose(raw.truth["blur"], radius_m / 5e-6, rtol=1e-5, atol=1e-5)


def test_maps_of_a_window_and_of_a_binned_frame_lie_where_the_frame_lies():
    depth_m = 50.0 + 1e-3 * np.arange(30000.0).reshape(150, 200)  # one scene pixel per photosite, without steps
    window = Window(40, 20, 80, 60)
    part = simulate(shot_of(np.ones((150, 200)), depth_m, noisy_camera(window=window), truth=("depth",)))
    np.testing.assert_array_equal(part.truth["depth"], depth_m[20:80, 40:120].astype(np.float32))
    binned = noisy_camera(window=window, binning=Binning(2, "charge"))
    found = simulate(shot_of(np.ones((150, 200)), depth_m, binned, truth=("depth", "blur"))).truth
    # Blocks of 4 x 4: a colour's sites lie two apart, their middle on the third of the four edges for the first of them.
    rows, columns = np.array([[20, 21]]) + np.arange(0, 60, 4)[:, None], np.array([[40, 41]]) + np.arange(0, 80, 4)[:, None]
    np.testing.assert_array_equal(found["depth"], depth_m[np.ix_(rows.ravel() + 1, columns.ravel() + 1)].astype(np.float32))
    whole = simulate(shot_of(np.ones((150, 200)), depth_m, noisy_camera(), truth=("blur",))).truth["blur"]
    np.testing.assert_allclose(found["blur"], whole[np.ix_(rows.ravel() + 1, columns.ravel() + 1)] / 2, rtol=1e-6)


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG"])
@pytest.mark.parametrize(("depth_m", "brightest"), [(2.0, 1.0), (4.0, 0.3)])
def test_clean_rgb_holds_the_mosaic_in_its_own_colours(cfa, depth_m, brightest):
    """In focus, and behind a blur of many photosites; the ADC clips a part of the sharp frame."""
    planes = RANDOM.uniform(0.0, brightest, (30, 40, 3))
    raw = simulate(shot_of(planes, depth_m, noisy_camera(cfa=cfa), truth=("rgb",)))
    rgb = raw.truth["rgb"]
    assert rgb.shape == (150, 200, 3) and rgb.dtype == np.float32
    assert rgb.min() < 0.5 and np.ptp(rgb) > 0.1 and (rgb.max() == 1.0) == (depth_m == 2.0)
    colour = np.tile(np.array(["RGB".index(letter) for letter in cfa]).reshape(2, 2), (75, 100))
    own = np.take_along_axis(rgb, colour[..., None], axis=2)[..., 0]
    black, white = np.float32(raw.black_level_dn), np.float32(raw.white_level_dn)
    np.testing.assert_array_equal(own, (raw.noise_free_dn - black) / (white - black))


def test_clean_rgb_of_a_flat_scene_is_each_channels_own_exposure():
    planes = np.broadcast_to([0.09, 0.03, 0.01], (4, 4, 3))  # from the blue end
    raw = simulate(shot_of(planes, truth=("rgb",)))
    sites = {"R": raw.noise_free_dn[0, 0], "G": raw.noise_free_dn[0, 1], "B": raw.noise_free_dn[1, 1]}
    expected = (np.array(list(sites.values()), float) - 128) / (4095 - 128)
    assert expected[0] < expected[1] < expected[2]
    np.testing.assert_allclose(raw.truth["rgb"], np.broadcast_to(expected, (150, 200, 3)), rtol=1e-6)


def test_a_shot_that_asks_for_nothing_more_gets_nothing_more():
    assert simulate(shot_of(np.ones((4, 4)))).truth == {}


@pytest.mark.parametrize("part", ["variance", "depth", "blur", "rgb"])
def test_what_a_part_holds_is_counted_before_the_shot_is_taken(part):
    """Peak of Python's own allocations on a frame large enough that tables of fixed size do not count."""
    device, scene = open_device(), RANDOM.uniform(0.1, 1.0, (60, 80, 3))
    shot = shot_of(scene, RANDOM.uniform(1.999, 2.001, (60, 80)), noisy_camera(1600, 1200), truth=(part,))
    planned = measure(plan(shot), device)
    mean_electrons = read_mean_electrons(device, planned.sensor, expose(planned, device))
    tracemalloc.start()
    compute_truth_maps(planned, shot.lens, device, mean_electrons)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    counted = planned.memory_bytes() - plan(replace(shot, truth=())).memory_bytes()
    on_device = 4 * 1600 * 1200 * (part == "rgb")
    assert peak - 2**21 <= counted - on_device <= 1.1 * peak, (peak, counted)
