"""Samples hold what they say: light, levels and variance against NumPy, and every sample is a function of its number alone."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from helpers.picture_files import put, random_codes
from helpers.randomness import accept, counts_p, mean_p
from helpers.toy_dataset import BLACK_DN, GAIN, READ_DN, WHITE_DN, ToyPictures, at_iso, toy_camera, toy_config, toy_samples
from scipy import ndimage, stats

from data_gen.generate import Generator, picture_window, shift_planes
from data_gen.recipe.camera_noise import CameraChoice, CameraNoise
from data_gen.recipe.dataset_config import Burst, MultiExposure, NoiseOnly
from data_gen.recipe.epoch_order import epoch_order
from data_gen.recipe.moving_camera import CameraMotion
from data_gen.recipe.recipe import draw_recipe
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.photographs import Photographs
from data_gen.sources.procedural import Procedural
from simulator.config.distributions import Uniform
from simulator.config.random_streams import RandomStream
from simulator.errors import PhotositeError
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.hot_pixels import HotPixels
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise


def same(first, second) -> bool:
    arrays = ("noisy_dn", "clean_dn", "variance_dn2")
    equal = all(
        np.array_equal(getattr(first, name), getattr(second, name)) for name in arrays if getattr(first, name) is not None
    )
    return equal and all(value == getattr(second, name) for name, value in vars(first).items() if name not in arrays)


def test_the_mean_of_noisy_frames_times_the_ratio_is_the_clean_code(device):
    ratio = 4.0
    whole = at_iso(toy_config(count=200, crop_px=(64, 64), exposure_ratio=ratio, augment=False, variance=True), 100)
    samples, _ = toy_samples(device, whole, source=ToyPictures(1))
    clean = samples[0].clean_dn[0].astype(np.float64)
    planes = ToyPictures(1).read("000", None).signal.astype(np.float64)
    mosaic = np.where(
        np.indices((64, 64)).sum(0) % 2 == 1,
        planes[..., 1],
        np.where(np.arange(64)[:, None] % 2, planes[..., 2], planes[..., 0]),
    )
    assert np.abs(clean - (BLACK_DN + mosaic * (WHITE_DN - BLACK_DN))).max() < 1e-3

    noisy = np.stack([sample.noisy_dn[0] for sample in samples]).astype(np.float64)
    electrons = mosaic * (WHITE_DN - BLACK_DN) / GAIN / ratio
    variance = GAIN**2 * electrons + READ_DN**2 + 1.0 / 12.0
    scaled = BLACK_DN + ratio * (noisy - BLACK_DN)
    z = (scaled.mean(0) - clean) / (ratio * np.sqrt(variance / len(samples)))
    spread = ((noisy - (BLACK_DN + (clean - BLACK_DN) / ratio)) ** 2 / samples[0].variance_dn2[0]).sum()
    chi2 = stats.chi2(noisy.size)
    accept(
        {
            "mean": mean_p(z, 0.0, 1.0),
            "each photosite": stats.chi2(z.size).sf((z**2).sum()),
            "variance map": 2.0 * min(chi2.sf(spread), chi2.cdf(spread)),
        }
    )
    assert np.abs(samples[0].variance_dn2[0] / variance - 1.0).max() < 1e-4


def test_light_beyond_saturation_is_clipped_in_the_reference_and_counted_in_the_noisy_frame(device):
    class Lamp(ToyPictures):
        def read(self, name, draw):
            picture = super().read(name, draw)
            return replace(picture, signal=np.full_like(picture.signal, 2.0))

    (sample,), _ = toy_samples(device, at_iso(toy_config(count=1, exposure_ratio=4.0), 100), source=Lamp())
    assert (sample.clean_dn == WHITE_DN).all()
    electrons = 2.0 * (WHITE_DN - BLACK_DN) / GAIN / 4.0
    noisy = sample.noisy_dn.astype(np.float64)
    accept({"mean": mean_p(noisy, BLACK_DN + GAIN * electrons, GAIN**2 * electrons + READ_DN**2 + 1 / 12)})


def test_a_well_that_fills_first_sets_the_white_level(device):
    stages = {"photon_shot_noise": PhotonShotNoise(), "full_well": FullWell(1000.0)}
    (sample,), _ = toy_samples(device, at_iso(toy_config(toy_camera(stages=stages), count=1), 100))
    assert sample.white_level_dn == BLACK_DN + GAIN * 1000.0
    assert sample.gain_dn_per_e == GAIN and sample.read_noise_dn == pytest.approx(np.sqrt(READ_DN**2 + 1 / 12))


DARK_E_PER_S = 200.0


def warm_camera(**more):
    """The toy camera with a dark current."""
    current = {"photon_shot_noise": PhotonShotNoise(), "dark_current": DarkCurrent(DARK_E_PER_S)}
    return toy_camera(stages=current | more)


def test_black_is_the_code_without_light_of_a_camera_with_dark_current(device):
    ratio, dark_e = 50.0, DARK_E_PER_S * 0.5
    config = at_iso(toy_config(warm_camera(), count=40, crop_px=(64, 64), exposure_ratio=ratio, variance=True), 100)
    config = replace(config, noise=replace(config.noise, exposure_time_s=0.5))
    p_values = {}
    for sample in toy_samples(device, config)[0]:
        assert sample.black_level_dn == pytest.approx(BLACK_DN + GAIN * dark_e) and sample.white_level_dn == WHITE_DN
        assert sample.read_noise_dn**2 == pytest.approx(GAIN**2 * dark_e + READ_DN**2 + 1 / 12)
        light = (sample.clean_dn.astype(np.float64) - sample.black_level_dn) / ratio
        variance = sample.gain_dn_per_e * light + sample.read_noise_dn**2
        assert np.abs(sample.variance_dn2 / variance - 1.0).max() < 1e-4
        z = (sample.noisy_dn - sample.black_level_dn - light) / np.sqrt(variance)
        p_values[f"mean {sample.index}"] = mean_p(z, 0.0, 1.0)
    accept(p_values)


def test_the_brightest_clean_code_is_white_behind_a_dark_current(device):
    config = at_iso(toy_config(warm_camera(), count=1, mode="noise_only", pictures={}, noise_only=NoiseOnly(1.0)), 100)
    (sample,), _ = toy_samples(device, config)
    assert (sample.clean_dn == WHITE_DN).all()


def test_hot_photosites_are_not_in_black(device):
    hot = warm_camera(hot_pixels=HotPixels(0.01, 1000.0))
    (sample,), _ = toy_samples(device, at_iso(toy_config(hot, count=1, mode="dark", pictures={}), 100))
    assert sample.black_level_dn == pytest.approx(BLACK_DN + GAIN * DARK_E_PER_S / 30)


def test_dark_current_follows_the_exposure_that_a_moving_camera_states():
    config = at_iso(toy_config(warm_camera(), motion=CameraMotion(exposure_time_s=Uniform((0.01, 0.1)))), 100)
    for recipe in (draw_recipe(config, index) for index in range(5)):
        dark_e = DARK_E_PER_S * recipe.moving.exposure_s
        assert recipe.setting.black_level_dn == pytest.approx(BLACK_DN + GAIN * dark_e)


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"exposure_time_s": 5.0}, "noise.exposure_time = 5 s: dark current alone saturates the toy at ISO 200"),
        ({}, "motion.exposure_time_s = 5 s: dark current alone saturates the toy at ISO 200"),
    ],
)
def test_an_exposure_that_dark_current_fills_is_refused(settings, message):
    noise = {"toy": CameraChoice(warm_camera())}
    with pytest.raises(PhotositeError, match=message):
        toy_config(noise=CameraNoise(noise, **settings), motion=CameraMotion(exposure_time_s=Uniform((0.01, 5.0))))


def test_a_sample_does_not_depend_on_the_others(device):
    config = toy_config(variance=True, crops_per_picture=3)
    samples, _ = toy_samples(device, config)
    again, _ = toy_samples(device, config, [13, 2, 19])
    assert all(same(samples[one.index], one) for one in again)
    assert not same(samples[0], samples[1])


def test_a_bad_picture_changes_only_the_samples_that_drew_it(device):
    config = toy_config(count=30)
    whole, _ = toy_samples(device, config)
    with_bad, generator = toy_samples(device, config, source=ToyPictures(bad=("006",)))
    drew = {sample.index for sample in whole if sample.source == "ramps/006"}
    assert drew and generator.problems == {"006: is broken": sorted(drew)}
    assert {index for index in range(30) if not same(whole[index], with_bad[index])} == drew
    assert all(sample.source != "ramps/006" for sample in with_bad)


def test_a_bad_picture_is_refused_when_the_configuration_says_so(device):
    with pytest.raises(PhotositeError, match="006: is broken"):
        toy_samples(device, toy_config(count=30, on_problem="refuse"), source=ToyPictures(bad=("006",)))


def test_a_collection_of_bad_pictures_ends(device):
    with pytest.raises(PhotositeError, match="none of 100 pictures"):
        toy_samples(device, toy_config(count=1), source=ToyPictures(2, bad=("000", "001")))


def test_every_frame_has_noise_of_its_own():
    config = toy_config(mode="burst", burst=Burst(4))
    seeds = [seed for index in range(500) for seed in draw_recipe(config, index).frame_seeds]
    assert len(set(seeds)) == 2000


def test_draws_are_even_over_samples():
    recipes = [draw_recipe(toy_config(), index) for index in range(4000)]
    isos = np.array([one.setting.iso for one in recipes])
    ratios = np.log(np.array([one.exposure_ratios[0] for one in recipes])) / np.log(16.0)
    kinds = np.unique([one.augmentation.name for one in recipes], return_counts=True)[1]
    windows = np.unique([one.window for one in recipes], axis=0)
    accept(
        {
            "iso": stats.binomtest(int((isos == 100).sum()), isos.size).pvalue,
            "ratio": stats.kstest(ratios, "uniform").pvalue,
            "augmentation": stats.chisquare(kinds).pvalue,
            "places": counts_p(np.bincount([hash(one.place) % 50 for one in recipes], minlength=50), 80.0),
            "independent": stats.pearsonr(isos, ratios).pvalue,
        }
    )
    assert len(kinds) == 8 and (windows % 2 == 0).all() and (windows.max(0) <= (96 - 24, 80 - 16)).all()


def test_bodies_are_as_many_as_asked_for():
    assert len({draw_recipe(toy_config(bodies=5), index).body_seed for index in range(200)}) == 5
    assert len({draw_recipe(toy_config(), index).body_seed for index in range(200)}) == 200


def test_samples_of_one_picture_are_read_once(device):
    pictures = ToyPictures()
    samples, _ = toy_samples(device, toy_config(crops_per_picture=5), source=pictures)
    assert len(pictures.read_names) == 4
    assert all(len({sample.source for sample in samples[first : first + 5]}) == 1 for first in range(0, 20, 5))


def test_a_burst_moves_the_scene_by_the_offsets_it_states(device):
    class Waves(ToyPictures):
        def read(self, name, draw):
            rows, columns = np.indices((64, 64))
            wave = 0.5 + 0.2 * np.sin(rows / 4.0) + 0.2 * np.cos(columns / 5.0)
            picture = super().read(name, draw)
            return replace(picture, signal=np.repeat(wave[..., None], 3, axis=2).astype(np.float32))

    config = toy_config(count=3, mode="burst", burst=Burst(4, Uniform((-2.0, 2.0))), augment=False, exposure_ratio=1.0)
    samples, _ = toy_samples(device, config, source=Waves())
    for sample in samples:
        span = sample.white_level_dn - sample.black_level_dn
        rows, columns = np.indices((16, 24)) + np.array(sample.crop)[:, None, None]
        assert sample.offsets_px[0] == (0.0, 0.0) and len(set(sample.offsets_px)) == 4
        for frame, (dy, dx) in zip(sample.clean_dn, sample.offsets_px, strict=True):
            expected = 0.5 + 0.2 * np.sin((rows - dy) / 4.0) + 0.2 * np.cos((columns - dx) / 5.0)
            assert np.abs((frame - sample.black_level_dn) / span - expected).max() < 1e-3


def test_moved_planes_are_scipys_cubic_splines():
    planes = np.random.default_rng(5).random((20, 22, 3)).astype(np.float32)
    expected = np.maximum(ndimage.shift(planes.astype(np.float64), (0.4, -1.3, 0), order=3, mode="nearest"), 0)[3:-3, 3:-3]
    assert np.abs(shift_planes(planes, (0.4, -1.3), 3) - expected).max() < 1e-5


def test_exposures_have_the_light_their_ratios_say(device):
    ratios = MultiExposure((1.0, 4.0, 16.0))
    config = at_iso(toy_config(count=4, mode="multi_exposure", multi_exposure=ratios, exposure_ratio=2.0), 100)
    p_values = {}
    for sample in toy_samples(device, config)[0]:
        assert sample.exposure_ratios == (2.0, 8.0, 32.0)
        for frame, clean, ratio in zip(sample.noisy_dn, sample.clean_dn, sample.exposure_ratios, strict=True):
            light = (clean.astype(np.float64) - BLACK_DN) / ratio
            z = (frame - BLACK_DN - light) / np.sqrt(GAIN * light + READ_DN**2 + 1 / 12)
            p_values[sample.index, ratio] = mean_p(z, 0.0, 1.0)
    accept(p_values)


def test_dark_frames_and_flat_frames_need_no_pictures(device):
    dark = toy_samples(device, at_iso(toy_config(count=30, mode="dark", pictures={}), 100))[0]
    flat = toy_samples(
        device, at_iso(toy_config(count=3, mode="noise_only", pictures={}, noise_only=NoiseOnly(0.25), exposure_ratio=1.0), 100)
    )[0]
    dark_dn = np.stack([sample.noisy_dn for sample in dark]).astype(np.float64)
    accept({"dark": mean_p(dark_dn, BLACK_DN, READ_DN**2 + 1 / 12)})
    assert all((sample.clean_dn == BLACK_DN).all() and sample.source == "" for sample in dark)
    assert all(np.unique(sample.clean_dn) == [np.float32(BLACK_DN + 0.25 * (WHITE_DN - BLACK_DN))] for sample in flat)


def test_a_crop_larger_than_the_sensor_is_refused():
    with pytest.raises(PhotositeError, match="96 x 80 photosites"):
        draw_recipe(toy_config(crop_px=(82, 24)), 0)


def photograph_config(folder, **settings):
    """Photographs of several sizes, orientations and depths."""
    for number in range(5):
        dtype = np.uint16 if number == 4 else np.uint8
        put(folder / f"{number}.tif", random_codes(40 + number, 50, dtype, number), Orientation=1 + number)
    photos = partial(Photographs, folder, inverse_isp="brooks2019")
    return toy_config(pictures={"photos": photos}, count=40, **settings)


@pytest.mark.parametrize("crops", [1, 4])
def test_photographs_give_the_same_samples_in_any_order_and_state_of_the_cache(device, tmp_path, crops):
    config = photograph_config(tmp_path / "in", crops_per_picture=crops)
    expected = list(Generator(config, device).samples(range(40)))
    size = 41 * 50 * 3 + 128
    for limit_bytes in (100 * size, 2 * size, 0):
        for _ in range(2):  # an empty cache, then one with files
            cache = DecodedPictures(limit_bytes, tmp_path / f"cache-{limit_bytes}")
            order = np.random.default_rng(limit_bytes).permutation(40).tolist()
            found = Generator(config, device, decoded=cache).samples(order)
            assert all(same(expected[one.index], one) for one in found)


def test_each_photograph_is_decoded_once_in_shuffled_epochs_of_few_that_fit(device, tmp_path):
    """Ten photographs, of which the cache has room for three: an epoch of whole groups decodes each group's picture once."""
    for number in range(10):
        put(tmp_path / "in" / f"{number}.png", random_codes(40, 50, seed=number))
    pictures = {"photos": partial(Photographs, tmp_path / "in", inverse_isp="brooks2019")}
    config = toy_config(pictures=pictures, count=160, crops_per_picture=16, seed=3)
    cache = DecodedPictures(3 * (40 * 50 * 3 + 128), tmp_path / "cache")
    order = epoch_order(RandomStream(0, 0), 0, 160, 16, 1)
    list(Generator(config, device, decoded=cache).samples(order))
    assert cache.cost.pictures <= 10


def test_how_many_pictures_are_in_use_follows_from_what_is_kept(tmp_path):
    put(tmp_path / "a.png", random_codes(40, 50))
    photos = {"photos": partial(Photographs, tmp_path, inverse_isp="brooks2019")}
    assert picture_window(toy_config(pictures=photos), DecodedPictures(0)) == 1
    assert picture_window(toy_config(pictures=photos), DecodedPictures(3_000_000_000)) == 20
    assert picture_window(toy_config(pictures=photos), DecodedPictures(10**12)) == 64
    drawn = {"leaves": partial(Procedural, ("dead_leaves",), width_px=1024, height_px=1024)}
    assert picture_window(toy_config(pictures=drawn), DecodedPictures(0)) == 21
