"""The sensor alone, many frames at once: a frame's codes are its own, whatever lies beside it."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import every_stage, small_camera
from helpers.kernel_bench import device_like
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import band_scene
from scipy import stats

from simulator.device import devices, open_device
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.published_noise_model import noise_model_stages
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack, frame_stack_moments
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.irradiance import Irradiance
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain

LEVELS = {"bit_depth": 14, "black_level_dn": 512.0}
RANDOM = np.random.default_rng(11)


def chains():
    """Different stage sets, and one set with different numbers."""
    full = [*every_stage().values(), ReadNoiseBeforeGain(4.0), ReadNoiseAfterGain(2.0), AnalogGain(0.7), Adc(14, 300.0)]
    return [
        noise_model_stages(1.5, 6.0, tukey_lambda=-0.1, row_sigma_dn=1.0, **LEVELS),
        noise_model_stages(0.2, 3.0, tukey_lambda=0.1, row_sigma_dn=0.3, **LEVELS),
        (AnalogGain(2.0), Adc(16, 0.0)),
        tuple(full),
        tuple(reversed(full)),
    ]


def stack(height=67, width=75):
    """Frames of all means and of large ones alone, places of every parity, and their settings."""
    settings = [
        FrameSetting(chain, Seeds(body=place % 3, frame=place), x=13 * place, y=7 * place + place % 2)
        for place, chain in enumerate(chains() * 2)
    ]
    powers = np.resize([0.0, 3.5, 0.5], (len(settings), 1, 1)) + RANDOM.uniform(-1, 1, (len(settings), height, width))
    return (10.0**powers).astype(np.float32), settings


def test_a_frame_does_not_depend_on_the_frames_beside_it(device):
    mean_electrons, settings = stack()
    together = expose_frame_stack(device, mean_electrons, settings)
    for place, setting in enumerate(settings):
        alone = expose_frame_stack(device, mean_electrons[place : place + 1], [setting])
        assert np.array_equal(alone[0], together[place]), place
    order = np.random.default_rng(2).permutation(len(settings))
    shuffled = expose_frame_stack(device, mean_electrons[order], [settings[place] for place in order])
    assert np.array_equal(shuffled, together[order])


def test_a_stack_larger_than_the_devices_constants_is_the_same(device):
    mean_electrons, settings = stack(20, 35)
    expected = expose_frame_stack(device, mean_electrons, settings), *frame_stack_moments(device, mean_electrons, settings)
    small = device_like(device, constant_bytes=1)
    found = expose_frame_stack(small, mean_electrons, settings), *frame_stack_moments(small, mean_electrons, settings)
    for one, other in zip(expected, found, strict=True):
        assert np.array_equal(one, other)


def test_frames_of_one_kind_are_one_launch(device, monkeypatch):
    launched = []
    run = device.run
    monkeypatch.setattr(device, "run", lambda kernel, *work, **rest: (launched.append(kernel.name), run(kernel, *work, **rest)))
    settings = [FrameSetting(noise_model_stages(gain, 2.0, **LEVELS), Seeds(frame=7), y=2) for gain in np.linspace(0.5, 2, 32)]
    expose_frame_stack(device, np.full((32, 64, 80), 1000.0), settings)
    assert launched == ["tile_range", "sensor"]


def test_tiles_of_all_shapes_are_one_launch_of_few_groups(device, monkeypatch):
    """1031 is a prime: no part of a row but one photosite divides it evenly."""
    launched = []

    def run(kernel, size, group, **rest):
        launched.append((kernel.name, np.prod(np.array(size) // np.array(group))))
        launch(kernel, size, group, **rest)

    launch = device.run
    monkeypatch.setattr(device, "run", run)
    settings = [FrameSetting(noise_model_stages(1.0, 2.0, **LEVELS), Seeds(frame=7), y=3)]
    expose_frame_stack(device, np.full((1, 133, 1031), 1000.0), settings)
    assert [name for name, _ in launched] == ["tile_range", "sensor"]
    assert all(groups < 500 for _, groups in launched)


def shot_of_everything():
    camera = small_camera(
        200,
        150,
        window=Window(31, 16, 120, 90),  # of even rows: PoCL builds for others anew
        bit_depth=14,
        black_level_dn=256.0,
        iso_table={100: IsoSetting(0.8, 4.0)},
        read_noise_after_gain_dn=2.0,
        stages=every_stage() | {"dark_current": DarkCurrent(600.0)},  # as many electrons as in `chains`: they share a build
    )
    scene = band_scene(RANDOM.uniform(0.0, 0.05, (30, 40, 3)), math.inf)
    return Shot(scene, ThinLens(50.0, 2.0), Exposure(0.01), camera, Seeds(4, 9), truth=("variance",))


def test_the_sensor_alone_gives_a_shots_own_codes_and_truth(device):
    """The same electrons, stages, seeds and place: the same bits, with lens and exposure in the kernel or before it."""
    shot = shot_of_everything()
    raw = simulate(shot)
    stages = tuple(shot.camera.sensor_stages(100, 0.01).values())
    setting = FrameSetting(stages, shot.seeds, shot.camera.frame.x, shot.camera.frame.y)
    mean_electrons = raw.mean_electrons[np.newaxis]
    assert np.ptp(mean_electrons) > 500
    assert np.array_equal(expose_frame_stack(device, mean_electrons, [setting])[0], raw.dn)
    noise_free_dn, variance_dn2 = frame_stack_moments(device, mean_electrons, [setting])
    assert np.array_equal(noise_free_dn[0], raw.noise_free_dn)
    assert np.array_equal(variance_dn2[0], raw.truth["variance"])


def test_frames_scatter_about_their_moments(device):
    """Mean and variance of each frame of a stack, against K n + black and K^2 n + sigma^2 + 1/12 in float64."""
    gains = (0.3, 1.0, 3.0)
    light = RANDOM.uniform(20.0, 500.0, (3, 200, 200)).astype(np.float32)
    settings = [FrameSetting(noise_model_stages(gain, 5.0, **LEVELS), Seeds(frame=place)) for place, gain in enumerate(gains)]
    codes = expose_frame_stack(device, light, settings)
    noise_free_dn, variance_dn2 = frame_stack_moments(device, light, settings)
    checks = {}
    for place, gain in enumerate(gains):
        mean = gain * light[place].astype(float) + 512.0
        variance = gain**2 * light[place].astype(float) + 25.0 + 1 / 12
        np.testing.assert_allclose(noise_free_dn[place], mean, rtol=1e-6)
        np.testing.assert_allclose(variance_dn2[place], variance, rtol=1e-4)
        residual = (codes[place] - mean) / np.sqrt(variance)
        checks |= {(gain, "mean"): mean_p(residual, 0.0, 1.0), (gain, "variance"): variance_p(residual, 1.0, 1 / 100)}
    accept(checks)


def test_moments_hold_full_well_and_the_clipping_of_each_frame(device):
    chain = (PhotonShotNoise(), AnalogGain(1.0), Adc(12, 100.0))
    settings = [
        FrameSetting(chain),
        FrameSetting((*chain, FullWell(500.0))),
        FrameSetting(noise_model_stages(8.0, 0.0, **LEVELS)),
    ]
    noise_free_dn, variance_dn2 = frame_stack_moments(device, np.full((3, 4, 5), 3000.0), settings)
    assert [set(frame.ravel().tolist()) for frame in noise_free_dn] == [{3100.0}, {600.0}, {2.0**14 - 1}]
    assert variance_dn2[0, 0, 0] == pytest.approx(3000 + 1 / 12, rel=1e-5)
    assert variance_dn2[1].max() < 0.1 and variance_dn2[2].max() < 1e-6


def test_every_device_gives_the_same_stack(device):
    mean_electrons, settings = stack(30, 40)
    expected = expose_frame_stack(device, mean_electrons, settings)
    for info in devices():
        assert np.array_equal(expose_frame_stack(open_device(info.label), mean_electrons, settings), expected), info.label


def test_a_device_with_memory_of_its_own_gives_the_same_stack(device):
    mean_electrons, settings = stack(30, 40)
    expected = expose_frame_stack(device, mean_electrons, settings)
    apart = device_like(device, shares_memory=False)
    assert np.array_equal(expose_frame_stack(apart, mean_electrons, settings), expected)


def test_the_noise_model_has_the_variance_it_says(device):
    """Tukey-lambda read noise of a given deviation, row noise, colour bias: one frame in the dark, against SciPy's numbers."""
    bias = (-4.0, 0.0, 3.0, 9.0)
    settings = dict(tukey_lambda=-0.1, row_sigma_dn=2.0, color_bias_dn=bias, bit_depth=16, black_level_dn=1000.0)
    codes = expose_frame_stack(device, np.zeros((1, 1000, 1000)), [FrameSetting(noise_model_stages(1.0, 6.0, **settings))])[
        0
    ].astype(float)
    codes -= np.tile(np.reshape(bias, (2, 2)), (500, 500)) + 1000.0
    rows = codes.mean(axis=1)
    within = (codes - rows[:, None]) * math.sqrt(1000 / 999)
    kurtosis = float(stats.tukeylambda.stats(-0.1, moments="k"))
    accept(
        {
            "rows": variance_p(rows, 4.0 + (36.0 + 1 / 12) / 1000),
            "read noise": variance_p(within, 36.0 + 1 / 12, kurtosis),
            "mean": mean_p(rows, 0.0, 4.0 + (36.0 + 1 / 12) / 1000),
        }
    )


def test_electrons_are_left_as_they_were_and_may_be_read_only(device):
    mean_electrons = np.full((1, 8, 33), 50.0, np.float32)
    mean_electrons.flags.writeable = False
    setting = FrameSetting(noise_model_stages(1.0, 2.0, **LEVELS))
    from_doubles = expose_frame_stack(device, mean_electrons.astype(np.float64)[:, ::-1], [setting])
    assert np.array_equal(expose_frame_stack(device, mean_electrons, [setting]), from_doubles)
    frame_stack_moments(device, mean_electrons, [setting])
    assert (mean_electrons == 50.0).all()


def test_an_empty_stack_is_an_empty_stack(device):
    assert expose_frame_stack(device, np.zeros((0, 8, 9)), []).shape == (0, 8, 9)
    assert [part.shape for part in frame_stack_moments(device, np.zeros((0, 8, 9)), [])] == [(0, 8, 9)] * 2


CHAIN = noise_model_stages(1.0, 2.0, **LEVELS)


@pytest.mark.parametrize(
    ("shape", "value", "count", "stages", "message"),
    [
        ((8, 9), 1.0, 1, CHAIN, "mean_electrons.*(8, 9).*frames, height, width"),
        ((2, 8, 9), 1.0, 1, CHAIN, "settings = 1 settings.*each of the 2 frames"),
        ((1, 8, 9), -1.0, 1, CHAIN, "mean_electrons = -1 to -1.*from 0"),
        ((1, 8, 9), math.nan, 1, CHAIN, "mean_electrons = nan"),
        ((1, 8, 9), math.inf, 1, CHAIN, "mean_electrons = inf"),
        ((1, 8, 9), 1.0, 1, (*CHAIN, Irradiance(1.0, 0.0, 0.0, 0.0)), r"settings\[0\].stages = irradiance"),
        ((1, 8, 9), 1.0, 1, CHAIN[:-1], "frame.stages.adc = missing"),
    ],
)
def test_what_cannot_be_is_one_message(device, shape, value, count, stages, message):
    with pytest.raises(PhotositeError, match=message.replace("(8, 9)", r"\(8, 9\)")):
        expose_frame_stack(device, np.full(shape, value), [FrameSetting(stages)] * count)


@pytest.mark.parametrize("place", [-1, 0.5, 2**24])
def test_a_corner_lies_on_a_sensor(place):
    with pytest.raises(PhotositeError, match="frame.y"):
        FrameSetting(CHAIN, y=place)


def test_stages_are_kept_in_physical_order_without_those_of_no_effect():
    chain = FrameSetting((*reversed(CHAIN), Prnu(0.0))).stages
    assert [stage.stem for stage in chain] == ["photon_shot_noise", "analog_gain", "read_noise_after_gain", "adc"]
    assert FrameSetting(CHAIN) == FrameSetting(tuple(reversed(CHAIN)))
    assert dataclasses.replace(FrameSetting(CHAIN), x=5).stages == chain
