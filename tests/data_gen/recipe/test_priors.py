"""Published priors: their constants, and that what is drawn has the distribution they state."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.randomness import accept, mean_p, variance_p
from helpers.toy_dataset import toy_camera, toy_config, toy_samples
from scipy import stats

from data_gen.recipe.dataset_config import NoiseOnly
from data_gen.recipe.prior_cameras import LED
from data_gen.recipe.published_priors import PRIORS, PriorNoise
from data_gen.recipe.recipe import draw_recipe
from simulator.config.distributions import Uniform
from simulator.config.random_streams import RandomStream
from simulator.errors import PhotositeError
from simulator.sensor.stages.stage import Stage
from simulator.sensor.stages.tukey_lambda_polynomial import tukey_lambda_deviation

COUNT = 2500


def drawn(name: str, count: int = COUNT) -> list[dict[str, Stage]]:
    """Stages by stem of many samples."""
    noise = PriorNoise(name, toy_camera())
    settings = [noise.draw_setting(RandomStream(3, index), RandomStream(3, index)) for index in range(count)]
    return [{stage.stem: stage for stage in setting.stages} | {"label": setting.label} for setting in settings]


@pytest.mark.parametrize(
    "name, log, read_at_0_01",
    [
        # unprocess.py: shot from 1e-4 to 0.012, ln read = 2.18 ln shot + 1.20 + N(0, 0.26); at 0.01 e^-8.839 = 1.449e-4
        ("unprocessing", np.log, 1.449e-4),
        # noise_sampling.py: the same line on decimal logarithms; at 0.01 10^-3.16 = 6.918e-4, 4.77 times as much
        ("cycleisp", np.log10, 6.918e-4),
    ],
)
def test_shot_and_read_noise_lie_on_the_published_line(name, log, read_at_0_01):
    stages = drawn(name)
    span = 65535 - 16384
    shot = np.array([one["analog_gain"].gain_dn_per_e for one in stages]) / span
    read = (np.array([one["read_noise_after_gain"].sigma_dn for one in stages]) / span) ** 2
    residual = (log(read) - (2.18 * log(shot) + 1.20)) / 0.26
    accept(
        {
            "shot": stats.kstest(log(shot), stats.uniform(log(1e-4), log(0.012) - log(1e-4)).cdf).pvalue,
            "read": stats.kstest(residual, "norm").pvalue,
            "independent": stats.pearsonr(residual, shot).pvalue,
        }
    )
    prior = PRIORS[name]
    assert prior.base ** (prior.slope * math.log(0.01, prior.base) + prior.intercept) == pytest.approx(read_at_0_01, rel=1e-3)
    assert all("photon_shot_noise" in one for one in stages) and prior.exposure_ratio == 1.0


# camera, lowest and highest ln K, slope and intercept of read scale and of row: noise.py and params of ELD, process.py of PMN.
LINES = {
    "eld: Canon EOS 5D Mark IV": (math.log(0.1), math.log(30), 0.65588, 1.09269, 0.28605, 0.47128, -0.80790, 0.24362),
    "eld: Canon EOS 70D": (math.log(0.1), math.log(30), 0.48681, 1.46427, 0.38201, 0.72922, -0.93706, 0.25022),
    "eld: Canon EOS 700D": (math.log(0.1), math.log(30), 0.59824, 1.53704, 0.38882, 0.62206, -0.77565, 0.24848),
    "eld: Nikon D850": (math.log(0.1), math.log(30), 0.47739, -0.09044, 0.23920, 0.44829, -1.79771, 0.23218),
    "eld: Sony A7S II": (math.log(0.1), math.log(30), 0.46210, 0.56571, 0.26337, 0.52754, -0.59170, 0.29429),
    "pmn: Sony A7S II, low gain": (-1.67214, 0.42228, 0.74043, 0.86182, 0.00712, 0.78782, -0.34227, 0.02832),
    "pmn: Sony A7S II, high gain": (0.64567, 2.51606, 0.74901, -0.12348, 0.00638, 0.62945, -1.51040, 0.02609),
    # noise_g_virtual.yaml: the ends of every range
    "led: virtual camera 0": (math.log(0.1), math.log(30), 0.46210, -0.09044, 0.23920, 0.44829, -1.79771, 0.23218),
    "led: virtual camera 4": (math.log(0.1), math.log(30), 0.65588, 1.53704, 0.38882, 0.72922, -0.59170, 0.29429),
}


@pytest.mark.parametrize("name, cameras, black", [("eld", 5, 800), ("pmn", 2, 512), ("led", 5, 512)])
def test_scales_lie_on_the_published_lines(name, cameras, black):
    stages = drawn(name)
    labels = sorted({one["label"] for one in stages})
    p_values = {"camera": stats.chisquare([sum(one["label"] == label for one in stages) for label in labels]).pvalue}
    for label in set(labels) & set(LINES):
        low, high, *lines = LINES[label]
        own = [one for one in stages if one["label"] == label]
        ln_gain = np.log([one["analog_gain"].gain_dn_per_e for one in own])
        p_values[label, "K"] = stats.kstest(ln_gain, stats.uniform(low, high - low).cdf).pvalue
        read = [one["read_noise_after_gain"] for one in own]
        scale = np.log([stage.sigma_dn / stats.tukeylambda.std(stage.tukey_lambda) for stage in read])
        row = np.log([one["row_noise"].sigma_dn for one in own])
        for what, values, (slope, intercept, deviation) in (("read", scale, lines[:3]), ("row", row, lines[3:])):
            residual = (values - slope * ln_gain - intercept) / deviation
            p_values[label, what] = stats.kstest(residual, "norm").pvalue
    accept(p_values)
    assert len(labels) == cameras and len(p_values) > 6
    assert {(one["adc"].black_level_dn, one["adc"].max_code) for one in stages} == {(black, 16383)}
    assert PRIORS[name].exposure_ratio == Uniform((100.0, 300.0))


@pytest.mark.parametrize("label", list(LINES))
def test_lines_have_the_published_constants(label):
    prior, name = label.split(": ")
    camera = next(camera for camera in PRIORS[prior].cameras if camera.name == name)
    assert (*camera.ln_gain, *camera.read_scale, *camera.row) == pytest.approx(LINES[label], abs=1e-5)


def test_shapes_are_the_published_ones():
    # The lists and single numbers of the parameter files; LED's five stand evenly from -17/70 to 0.2.
    shapes = {name: {one["read_noise_after_gain"].tukey_lambda for one in drawn(name, 1000)} for name in ("eld", "pmn", "led")}
    assert min(shapes["eld"]) == pytest.approx(-17 / 70) and max(shapes["eld"]) == pytest.approx(0.2)
    assert shapes["pmn"] == {-0.026, -0.025}
    assert sorted(shapes["led"]) == pytest.approx([-0.242857, -0.132143, -0.0214286, 0.0892857, 0.2], abs=1e-6)


def test_a_published_scale_is_no_standard_deviation():
    # PMN measured both for the A7S II at ISO 100: lambda 0.14875, scale 0.70182, Gaussian 1.00674 DN.
    assert 0.70182 * tukey_lambda_deviation(0.14875287) == pytest.approx(1.00674, rel=5e-3)


def test_colour_biases_of_led_have_a_common_level_and_a_spread_that_grows_with_the_camera():
    stages = drawn("led")
    part = (3.0379589 - 0.006866596) / 14.5
    p_values = {}
    for number, camera in enumerate(LED):
        assert camera.color_bias_deviation == pytest.approx((0.9 * part * number, 0.9 * part * number + part))
        bias = np.array([one["color_bias"].offsets_dn for one in stages if one["label"].endswith(str(number))])
        square = np.mean(np.linspace(*camera.color_bias_deviation, 100_001) ** 2)
        fourth = 3 * np.mean(np.linspace(*camera.color_bias_deviation, 100_001) ** 4)
        half = (bias[:, 0] - bias[:, 1]) / math.sqrt(2.0)
        p_values[number, "spread"] = mean_p(half**2, square, fourth - square**2)
        p_values[number, "level"] = mean_p(bias[:, 2], (4.080531 - 1.9080039) / 2, 5.9885349**2 / 12 + square)
    accept(p_values)


@pytest.mark.parametrize("name", list(PRIORS))
def test_a_noisy_frame_has_the_moments_that_the_prior_drew(device, name):
    config = replace(toy_config(), noise=PriorNoise(name, toy_camera()), mode="noise_only", noise_only=NoiseOnly(0.3))
    samples, _ = toy_samples(device, replace(config, count=6, crop_px=(64, 64), variance=True, exposure_ratio=1.0, pictures={}))
    p_values = {}
    for sample in samples:
        light = 0.3 * (sample.white_level_dn - sample.black_level_dn)
        code = sample.noisy_dn[0].astype(np.float64)
        variance = sample.gain_dn_per_e * light + sample.read_noise_dn**2
        assert sample.variance_dn2[0] == pytest.approx(variance, rel=1e-3) and sample.iso == 0
        stages = {stage.stem: stage for stage in draw_recipe(config, sample.index).setting.stages}
        row_dn = stages["row_noise"].sigma_dn if "row_noise" in stages else 0.0
        bias_dn = np.mean(stages["color_bias"].offsets_dn) if "color_bias" in stages else 0.0
        shape, read_dn = stages["read_noise_after_gain"].tukey_lambda, stages["read_noise_after_gain"].sigma_dn
        tails = 0.0 if shape is None else float(stats.tukeylambda.stats(shape, moments="k"))
        each = variance - row_dn**2
        of_mean = row_dn**2 / 64 + each / code.size
        # Colours of a row have their own biases, so each half row has its own mean.
        halves = code.reshape(64, 32, 2)
        apart = (halves - halves.mean(axis=1, keepdims=True)) * np.sqrt(32 / 31)
        p_values[sample.index, "mean"] = mean_p(code.mean(), sample.black_level_dn + light + bias_dn, of_mean)
        p_values[sample.index, "variance"] = variance_p(apart, each, tails * (read_dn**2 / each) ** 2)
    accept(p_values)


def test_an_unknown_prior_is_refused():
    with pytest.raises(PhotositeError, match="unprocessing, cycleisp, eld, pmn, led"):
        PriorNoise("sidd", toy_camera())
