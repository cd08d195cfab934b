"""A body is a body: its fixed pattern is the same in every frame, another body has another one, and nothing else is shared."""

import itertools

import numpy as np
import pytest
from helpers.camera_builders import every_effect
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import stats

from simulator.device import devices, open_device
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Moments

SHAPE = (300, 400)
BLACK = 1000.0


def stage(stem, *values, **named):
    return STAGES[stem](*values, **named)


# Each noise alone, strong enough that rounding does not hide it, with the light it needs.
FIXED = {
    "prnu": (stage("prnu", 0.02), 5000.0),
    "dsnu": (stage("dsnu", 60.0), 0.0),
    "dead_pixels": (stage("dead_pixels", 0.3), 100.0),
    "column_offset": (stage("column_offset", 50.0), 0.0),
}
TEMPORAL = {
    "photon_shot_noise": (stage("photon_shot_noise"), 900.0),
    "few photons": (stage("photon_shot_noise"), 3.0),
    "dark_current": (stage("dark_current", 400.0, 1.0), 0.0),
    "read_noise_before_gain": (stage("read_noise_before_gain", 50.0), 0.0),
    "row_noise": (stage("row_noise", 50.0), 0.0),
    "read_noise_after_gain": (stage("read_noise_after_gain", 50.0), 0.0),
    "Tukey-lambda": (stage("read_noise_after_gain", 50.0, tukey_lambda=-0.1), 0.0),
}
BOTH = {  # a place of the body, and chance in each frame
    "hot_pixels": (stage("hot_pixels", 0.5, 500.0, 1.0), 0.0),
    "random_telegraph_noise": (stage("random_telegraph_noise", 0.5, 60.0), 0.0),
    "read noise with spread": (stage("read_noise_before_gain", 50.0, 0.7), 0.0),
}
ALL = FIXED | TEMPORAL | BOTH
COMMON = {"row_noise": 1, "column_offset": 0}  # noise that a whole row or column has in common, and the axis along which


def picture(bench, name, frame=1, body=2, shape=SHAPE):
    """A frame of one noise alone, float64 less black."""
    only, light = ALL[name]
    return bench.sensor(np.full(shape, light), only, black=BLACK, frame_seed=frame, body_seed=body).astype(float) - BLACK


def squared(image):
    """Squares about the mean: where the noise is strong, whatever its sign."""
    return (image - image.mean()) ** 2


# --- the fixed pattern ---

LIGHT_E, READ_E, AFTER_DN, PRNU, DSNU_E = 500.0, 4.0, 2.0, 0.02, 9.0
BODY = (
    stage("prnu", PRNU),
    stage("photon_shot_noise"),
    stage("dsnu", DSNU_E),
    stage("read_noise_before_gain", READ_E),
    stage("read_noise_after_gain", AFTER_DN),
)
TEMPORAL_VARIANCE = LIGHT_E + READ_E**2 + AFTER_DN**2 + 1 / 12
FIXED_VARIANCE = (PRNU * LIGHT_E) ** 2 + DSNU_E**2


def burst(bench, seeds, body=2):
    """Mean of the frames of these seeds."""
    light = np.full(SHAPE, LIGHT_E)
    frames = (bench.sensor(light, *BODY, black=BLACK, frame_seed=seed, body_seed=body) for seed in seeds)
    return sum(frame.astype(float) for frame in frames) / len(seeds)


def test_a_burst_averages_down_to_the_fixed_pattern(bench):
    """Variance over photosites of the mean of n frames: temporal / n + fixed; of two such means' difference: 2 temporal / n."""
    checks = {}
    for start, count in ((100, 1), (200, 4), (300, 16), (400, 64)):
        one, other = burst(bench, range(start, start + count)), burst(bench, range(1000 + start, 1000 + start + count))
        checks[count, "mean"] = mean_p(one, BLACK + LIGHT_E, TEMPORAL_VARIANCE / count + FIXED_VARIANCE)
        checks[count, "temporal"] = variance_p((one - other) / np.sqrt(2.0), TEMPORAL_VARIANCE / count)
        checks[count, "with the pattern"] = variance_p(one, TEMPORAL_VARIANCE / count + FIXED_VARIANCE)
    accept(checks)


def test_the_model_knows_both_variances():
    signal = Moments(LIGHT_E, 0.0)
    for part in (*BODY[:4], AnalogGain(1.0), BODY[4], Adc(16, BLACK)):
        signal = part.moments(signal)
    assert signal.mean == BLACK + LIGHT_E
    assert (signal.variance, signal.fixed_variance) == pytest.approx((TEMPORAL_VARIANCE, FIXED_VARIANCE))


def test_the_pattern_belongs_to_the_body(bench):
    """Bursts of one body correlate as their shared variance says (Fisher's z); those of two bodies not at all."""
    count = 16
    one, again, other = burst(bench, range(count)), burst(bench, range(50, 50 + count)), burst(bench, range(90, 90 + count), 3)
    shared = FIXED_VARIANCE / (FIXED_VARIANCE + TEMPORAL_VARIANCE / count)
    z = (np.arctanh(np.corrcoef(one.ravel(), again.ravel())[0, 1]) - np.arctanh(shared)) * np.sqrt(one.size - 3)
    accept({"same body": 2 * stats.norm.sf(abs(z)), "another body": correlation_p(one, other)})


@pytest.mark.parametrize("name", FIXED)
def test_a_fixed_noise_is_the_same_in_every_frame_and_other_in_another_body(bench, name):
    first, second = picture(bench, name, frame=1), picture(bench, name, frame=2)
    assert np.array_equal(first, second) and first.std() > 1
    accept({"another body": correlation_p(*(reduced(image, name) for image in (first, picture(bench, name, body=3))))})


@pytest.mark.parametrize("name", BOTH)
def test_strong_places_stay_where_they_are(bench, name):
    """Where the noise is strong in some frames of a body it is strong in others, and not in another body."""
    strength = [
        sum(squared(picture(bench, name, frame, body)) ** 0.5 for frame in frames)
        for body, frames in ((2, range(8)), (2, range(8, 16)), (3, range(16, 24)))
    ]
    assert correlation_p(strength[0], strength[1]) < 1e-30
    accept({"another body": correlation_p(strength[0], strength[2])})


# --- nothing else is shared ---


def reduced(image, name):
    """One number for each draw of the noise."""
    return image.mean(axis=COMMON[name]) if name in COMMON else image


def independent_p(one, other, axis=None):
    """P-values of values, of strengths, and of the joint distribution; axis: average over it first."""
    pairs = {"values": (one, other), "strengths": (squared(one), squared(other))}
    if axis is not None:
        pairs = {what: (a.mean(axis=axis), b.mean(axis=axis)) for what, (a, b) in pairs.items()}
    found = {what: correlation_p(a, b) for what, (a, b) in pairs.items()}
    return found if axis is not None else {**found, "joint": contingency_p(one, other)}


def contingency_p(one, other, classes=8):
    """Chi-square test of independence in classes of about equal size."""
    shares = np.arange(1, classes) / classes
    first, second = (np.digitize(image, np.unique(np.quantile(image, shares))).ravel() for image in (one, other))
    table = np.bincount(classes * first + second, minlength=classes**2).reshape(classes, classes)
    return float(stats.chi2_contingency(table[np.ix_(table.any(axis=1), table.any(axis=0))]).pvalue)


def test_noises_do_not_depend_on_each_other(bench):
    """Every pair of noises of one frame of one body; those of rows or columns by the means of rows or columns."""
    images, checks = {name: picture(bench, name) for name in ALL}, {}
    same = [{"photon_shot_noise", "few photons"}, {"read_noise_after_gain", "Tukey-lambda"}]
    same += [{"read_noise_before_gain", "read noise with spread"}]
    for one, other in itertools.combinations(images, 2):
        axes = {COMMON[name] for name in (one, other) if name in COMMON}
        if len(axes) < 2 and {one, other} not in same:
            found = independent_p(images[one], images[other], axes.pop() if axes else None)
            checks.update({(one, other, what): p for what, p in found.items()})
    assert len(checks) > 150
    accept(checks)


@pytest.mark.parametrize("name", TEMPORAL)
def test_frames_do_not_depend_on_each_other(bench, name):
    checks = {}
    for body in (2, 7):  # 7 is a frame's seed, too
        first, second = (picture(bench, name, frame, body) for frame in (7, 8))
        found = independent_p(first, second, COMMON.get(name))
        checks.update({(body, what): p for what, p in found.items()})
    accept(checks)


@pytest.mark.parametrize("name", BOTH)
def test_chance_in_fixed_places_is_new_in_each_frame(bench, name):
    """Differences of frames: what a photosite has in common is gone."""
    first, second, third, fourth = (picture(bench, name, frame) for frame in (7, 8, 9, 10))
    accept({"differences": correlation_p(first - second, third - fourth)})


NEIGHBOURS = [(0, 1), (1, 0), (1, 1), (1, -1), (0, 2), (2, 0), (2, 2)]


@pytest.mark.parametrize("name", ALL)
def test_neighbours_do_not_depend_on_each_other(bench, name):
    image, checks = picture(bench, name), {}
    for down, right in NEIGHBOURS:
        one = image[: -down or None, max(0, -right) : SHAPE[1] - max(0, right)]
        other = image[down:, max(0, right) : SHAPE[1] - max(0, -right)]
        for parity in (0, 1):  # rows are computed in pairs
            pair = (one[parity::2], other[parity::2])
            if name in COMMON:
                if (down, right)[COMMON[name] == 0] == 0:
                    continue  # the same draw
                pair = tuple(reduced(part, name) for part in pair)
            found = independent_p(*pair)
            checks.update({(down, right, parity, what): p for what, p in found.items()})
    accept(checks)


def test_a_frame_seed_equal_to_the_body_seed_mixes_nothing(bench):
    images = {name: picture(bench, name, frame=5, body=5) for name in ALL if name not in COMMON}
    pairs = [(fixed, chance) for fixed in FIXED for chance in TEMPORAL if fixed in images and chance in images]
    checks = {}
    for one, other in pairs:
        checks.update({(one, other, what): p for what, p in independent_p(images[one], images[other]).items()})
    accept(checks)


# --- the same bits ---

EVERYTHING = every_effect()
SENSOR = np.exp(np.random.default_rng(3).uniform(3.5, 11, (70, 90))).astype(np.float32)


@pytest.fixture(scope="module")
def whole(bench):
    return bench.sensor(SENSOR, *EVERYTHING, gain=0.7, black=300.0)


@example(89, 69, 1, 1)
@example(13, 7, 16, 1)
@given(st.integers(0, 89), st.integers(0, 69), st.sampled_from([1, 16, 43]), st.integers(1, 70))  # PoCL builds for each width
@settings(max_examples=80, deadline=None, derandomize=True, database=None)
def test_any_window_is_the_part_of_the_whole(bench, whole, x, y, width, height):
    part = np.s_[y : y + height, min(x, 90 - width) : min(x, 90 - width) + width]
    codes = bench.sensor(SENSOR[part], *EVERYTHING, gain=0.7, black=300.0, x=part[1].start, y=y)
    assert np.array_equal(codes, whole[part])


@pytest.mark.parametrize(("row", "height"), [(1, 64), (7, 2), (64, 6), (90, 70)])
def test_any_work_group_and_tile_gives_the_same_bits(bench, whole, row, height):
    found = bench.like(row_px=row).sensor(SENSOR, *EVERYTHING, gain=0.7, black=300.0, tile_height=height)
    assert np.array_equal(found, whole)


def test_every_device_gives_the_same_bits(bench):
    """Each OpenCL device of this machine, in light and dark; with one alone, that runs repeat."""
    light = np.exp(np.random.default_rng(4).uniform(-3, 11, (70, 90))).astype(np.float32)
    expected = bench.sensor(light, *EVERYTHING, gain=0.7, black=300.0)
    for info in devices():
        other = type(bench)(open_device(info.label))
        assert np.array_equal(other.sensor(light, *EVERYTHING, gain=0.7, black=300.0), expected), info.label
