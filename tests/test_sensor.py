"""The fused kernel as a whole: order of stages, invariance to tiles, and the same bits on every device."""

import re

import numpy as np
import pytest

from simulator import tiles
from simulator.device import devices, kernel_source, open_device
from simulator.fused import FUSED, stage_order
from simulator.sensor.dark_current import DarkCurrent
from simulator.sensor.full_well import FullWell
from simulator.sensor.photon_shot_noise import PhotonShotNoise
from simulator.sensor.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.read_noise_before_gain import ReadNoiseBeforeGain

EVERYTHING = (PhotonShotNoise(), DarkCurrent(3.0, 2.0), FullWell(20000.0), ReadNoiseBeforeGain(4.0), ReadNoiseAfterGain(2.0))


def picture(height=100, width=1100):
    return np.exp(np.random.default_rng(3).uniform(-3, 11, (height, width))).astype(np.float32)


def test_stages_stand_in_physical_order():
    light = ["irradiance", "exposure", "photon_shot_noise", "dark_current", "full_well"]
    chain = [*light, "read_noise_before_gain", "analog_gain", "read_noise_after_gain", "adc"]
    assert [stem for stem in stage_order() if stem in chain] == chain
    assert set(stage_order()) == set(FUSED)


@pytest.mark.parametrize(("width", "height"), [(64, 8), (1000, 2), (333, 32)])
def test_tile_size_changes_no_bit(bench, monkeypatch, width, height):
    expected = bench.sensor(picture(), *EVERYTHING, gain=0.7, black=300.0)
    monkeypatch.setattr(bench.device, "row_px", width)
    monkeypatch.setattr(tiles, "TILE_HEIGHT", height)
    assert np.array_equal(bench.sensor(picture(), *EVERYTHING, gain=0.7, black=300.0), expected)


def test_a_crop_is_the_part_of_the_whole(bench):
    whole = bench.sensor(picture(), *EVERYTHING)
    assert np.array_equal(bench.sensor(picture()[41:90, 377:1001], *EVERYTHING, x=377, y=41), whole[41:90, 377:1001])


def test_every_device_gives_the_same_bits(bench):
    """All OpenCL devices here; with one device this compares it with itself and still checks that runs repeat."""
    expected = bench.sensor(picture(), *EVERYTHING, gain=0.7, black=300.0)
    for info in devices():
        other = type(bench)(open_device(info.label))
        assert np.array_equal(other.sensor(picture(), *EVERYTHING, gain=0.7, black=300.0), expected), info.label


def test_frames_of_any_size_are_covered(bench):
    for shape in ((1, 1), (3, 511), (33, 513), (64, 1024)):
        assert (bench.sensor(np.full(shape, 77.0)) == 77).all()


def test_kernels_keep_to_plain_operators():
    """Built-in functions are opaque scalar calls on some PoCL builds, and vendor maths differs by device."""
    calls = set(re.findall(r"\b([a-z_]\w*)\s*\(", re.sub(r"//.*", "", kernel_source("sensor.cl"))))
    builtin = {
        "fma",
        "mad",
        "sqrt",
        "rsqrt",
        "exp",
        "log",
        "pow",
        "floor",
        "rint",
        "clamp",
        "fmax",
        "fmin",
        "select",
        "erfc",
        "mul_hi",
        "sin",
        "cos",
        "sinpi",
        "cospi",
        "convert_ushort_sat",
        "min",
        "max",
        "fabs",
    }
    assert not calls & builtin and not any(call.startswith("native_") for call in calls)
