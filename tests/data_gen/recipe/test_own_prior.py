"""A prior of one's own: what is drawn lies on the lines of the file, with their scatter, and a bad line is told."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.randomness import accept
from helpers.toy_dataset import toy_camera, toy_config, toy_samples
from scipy import stats

from data_gen.recipe.dataset_config import NoiseOnly, load_data_set
from data_gen.recipe.own_prior import LineNoise, NoiseLine, OwnPrior
from data_gen.recipe.prior_cameras import ELD
from data_gen.recipe.published_priors import LinePrior
from simulator.config.random_streams import RandomStream
from simulator.errors import PhotositeError

READ, ROW = NoiseLine(0.6, 1.2, 0.3), NoiseLine(0.5, -0.8, 0.2)
MINE = LineNoise(0.1, 30.0, READ, ROW, (-0.1, 0.0, 0.1), weight=3.0)
PLAIN = LineNoise(0.5, 8.0, NoiseLine(1.0, 0.4))
FILE = """
count: 4
crop: [32, 32]
pictures: {drawings: {procedural: [text], count: 4, width: 64, height: 64}}
noise:
  camera: sony_a7s2
  black_level: 512 DN
  lines:
    mine: {lowest_gain: 0.1 DN/e-, highest_gain: 30 DN/e-, read_noise: {slope: 0.6, intercept: 1.2, scatter: 0.3}}
"""


def own(**more) -> OwnPrior:
    return OwnPrior({"mine": MINE, "plain": PLAIN}, toy_camera(), 512.0, **more)


def drawn(noise: OwnPrior, count: int = 2500):
    settings = [noise.draw_setting(RandomStream(3, index), RandomStream(3, index)) for index in range(count)]
    return [{stage.stem: stage for stage in setting.stages} | {"label": setting.label} for setting in settings]


def residual(sigma_dn: list[float], ln_gain: np.ndarray, line: NoiseLine) -> np.ndarray:
    return (np.log(sigma_dn) - line.slope * ln_gain - line.intercept) / line.scatter


def test_noises_lie_on_the_lines_with_their_scatter_and_lines_have_their_weights():
    samples = drawn(own())
    mine = [one for one in samples if one["label"] == "mine"]
    ln_gain = np.log([one["analog_gain"].gain_dn_per_e for one in mine])
    read = residual([one["read_noise_after_gain"].sigma_dn for one in mine], ln_gain, READ)
    row = residual([one["row_noise"].sigma_dn for one in mine], ln_gain, ROW)
    shapes = [one["read_noise_after_gain"].tukey_lambda for one in mine]
    accept(
        {
            "weights": stats.binomtest(len(mine), len(samples), 0.75).pvalue,
            "K": stats.kstest(ln_gain, stats.uniform(math.log(0.1), math.log(300.0)).cdf).pvalue,
            "read": stats.kstest(read, "norm").pvalue,
            "row": stats.kstest(row, "norm").pvalue,
            "independent": stats.pearsonr(read, row).pvalue,
            "shapes": stats.chisquare([shapes.count(shape) for shape in MINE.tukey_lambda]).pvalue,
        }
    )


def test_a_pedestal_below_four_deviations_of_the_dark_is_told():
    """ln sigma = ln K + 0.4: at K = 8 DN/e- 11.9 DN, four of which are 47.7 DN."""
    enough, little = (OwnPrior({"plain": PLAIN}, toy_camera(), black_dn) for black_dn in (48.0, 47.0))
    assert enough.warnings() == () and len(little.warnings()) == 1
    assert little.warnings()[0].startswith("plain: codes of black end at 0")


def test_a_line_without_scatter_rows_and_shapes_is_exact_and_normal():
    for one in drawn(own(), 400):
        if one["label"] == "plain":
            sigma_dn = math.exp(0.4) * one["analog_gain"].gain_dn_per_e
            assert one["read_noise_after_gain"].sigma_dn == pytest.approx(sigma_dn, rel=1e-8)
            assert one["read_noise_after_gain"].tukey_lambda is None and "row_noise" not in one


def test_the_published_prior_is_drawn_from_its_numbers_in_a_file():
    """Same numbers, same draws: the model is one."""
    lines = {}
    for camera in ELD:
        gains = [math.exp(end) for end in camera.ln_gain]
        lines[camera.name] = LineNoise(*gains, NoiseLine(*camera.read_scale), NoiseLine(*camera.row), camera.lambdas)
    noise = OwnPrior(lines, toy_camera(), 800.0, read_noise_is="tukey_scale")
    prior = LinePrior(ELD, 800.0, 1.0, weights=(1.0,) * len(ELD))
    for index in range(50):
        setting = noise.draw_setting(RandomStream(5, index), RandomStream(5, index))
        name, stages = prior.stages(RandomStream(5, index))
        assert setting.label == name
        for ours, published in zip(setting.stages, stages, strict=True):
            assert type(ours) is type(published)
            given = vars(published)
            assert {key: value for key, value in vars(ours).items() if isinstance(value, float)} == pytest.approx(
                {key: value for key, value in given.items() if isinstance(value, float)}, rel=1e-8
            )


def test_noisy_frames_have_the_variance_that_was_drawn(device):
    config = replace(toy_config(), noise=own(), mode="noise_only", noise_only=NoiseOnly(0.3))
    samples, _ = toy_samples(device, replace(config, count=3, crop_px=(64, 64), variance=True, exposure_ratio=1.0, pictures={}))
    for sample in samples:
        light = 0.3 * (sample.white_level_dn - sample.black_level_dn)
        variance = sample.gain_dn_per_e * light + sample.read_noise_dn**2
        assert sample.variance_dn2[0] == pytest.approx(variance, rel=1e-3) and sample.iso == 0


def test_a_file_states_it(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(FILE, encoding="utf-8")
    noise = load_data_set(path).noise
    assert isinstance(noise, OwnPrior) and noise.lines == {"mine": LineNoise(0.1, 30.0, READ)}
    assert noise.table() == [("mine", "K 0.1 to 30 DN/e-")] and noise.exposure_ratio == 1.0


def test_the_library_s_example_is_read():
    noise = load_data_set("own_prior").noise
    assert (
        set(noise.lines) == {"canon_700d", "canon_70d"} and noise.black_level_dn == noise.camera.iso_setting(100).black_level_dn
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("lowest_gain: 0.1 DN/e-", "lowest_gain: 0 DN/e-", "lowest_gain = 0 DN/e-: give a gain above 0"),
        ("highest_gain: 30 DN/e-", "highest_gain: 0.1 DN/e-", "highest_gain = 0.1 DN/e-: give more than the lowest"),
        ("highest_gain: 30 DN/e-", "highest_gain: 30", "has no unit"),
        ("scatter: 0.3", "scatter: -1", "scatter = -1.0: a standard deviation is not negative"),
        ("intercept: 1.2", "intercept: 9", "read_noise = intercept 9: reaches .* more than the 16383 codes; lower the line"),
        ("intercept: 1.2", "intercept: 900", "reaches inf DN"),
        ("slope: 0.6", "slope: .inf", "slope"),
        ("scatter: 0.3}", "scatter: 0.3}, tukey_lambda: [0.4]", "tukey_lambda"),
        ("scatter: 0.3}", "scatter: 0.3}, weight: 0", "weight"),
        ("black_level: 512 DN", "black_level: 512 DN\n  read_noise_is: tukey_scale", "needs its shapes; give a list"),
        ("camera: sony_a7s2", "camera: ideal", "need a 2x2 colour filter"),
        (
            "camera: sony_a7s2",
            "camera: {base: sony_a7s2, cfa: RRGG/RRGG/GGBB/GGBB}",
            "noise.camera.cfa = RRGG/RRGG/GGBB/GGBB: data sets need a 2x2 colour filter",
        ),
        ("    mine: {", "    mine: {rown_noise: 1, ", "rown_noise: unknown key; did you mean `row_noise`"),
        ("black_level: 512 DN", "black_level: 20000 DN", "black_level"),
    ],
)
def test_bad_lines_are_told_with_file_and_fix(old, new, message, tmp_path):
    path = tmp_path / "mine.yaml"
    assert old in FILE
    path.write_text(FILE.replace(old, new), encoding="utf-8")
    with pytest.raises(PhotositeError, match=message) as raised:
        load_data_set(path)
    assert ".yaml:" in str(raised.value)
