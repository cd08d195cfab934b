"""One charge read at both conversion gains: the same amplifier, the noise of each, and the range of the low one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import band_scene

from simulator.config import load_camera
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.seeds import Seeds

CAMERA = replace(load_camera("illustrative/dual_gain"), window=Window(2000, 1000, 240, 240))


def shot(time_s=0.01, iso=640, level=1.0) -> Shot:
    scene = band_scene(np.full((2, 2, 3), level), math.inf)
    return Shot(scene, ThinLens(50.0, 8.0, cos4=False), Exposure(time_s, iso), CAMERA, Seeds(frame=5))


def readings(iso=640):
    sensor = plan(shot(iso=iso)).sensor
    assert isinstance(sensor, HdrSensorPlan)
    return sensor, [{stage.stem: stage for stage in one.sensor.stages} for one in sensor.readings]


@pytest.mark.parametrize("iso", [640, 1250, 1890])
def test_both_readings_have_one_analog_gain_and_two_conversion_gains(iso):
    sensor, (high, low) = readings(iso)
    assert high["conversion_gain"].ratio == 2.96 and "conversion_gain" not in low
    assert high["analog_gain"].gain_dn_per_e == pytest.approx(low["analog_gain"].gain_dn_per_e, rel=1e-6)
    for reading in (high, low):  # electrons at low conversion gain
        assert reading["read_noise_before_gain"].sigma_e == pytest.approx(3.05, rel=1e-12)
    # The range ends where the second reading saturates, 2.96 times farther.
    alone = sensor.plans[0].white_level_dn() - sensor.plans[0].black_level_dn
    assert (sensor.white_level_dn() - sensor.black_level_dn) * sensor.unit_dn == pytest.approx(2.96 * alone, rel=1e-3)


def test_outside_of_both_gains_the_readings_have_one():
    for iso, ratios in ((500, (None, None)), (3200, (2.96, 2.96))):
        _, found = readings(iso)
        assert tuple(getattr(one.get("conversion_gain"), "ratio", None) for one in found) == ratios


def test_dark_and_bright_frames_have_the_noise_of_their_reading():
    """In electrons: 3.05 / 2.96 and 1.223 DN / K at high gain; 3.05 and 1.223 DN / K at low gain."""
    gain, checks = 0.181 * 6.4, {}
    sensor, _ = readings()
    for name, time_s, ratio in (("dark", 1e-9, 2.96), ("bright", 0.0, 1.0)):
        if name == "bright":  # green beyond the switch point of the first reading
            of_one = simulate(shot(1e-3)).mean_electrons[1, 0]
            time_s = 1e-3 * 1.3 * sensor.readings[0].sensor.electrons_at_white() / of_one
        raw = simulate(shot(time_s))
        mean_e, own_gain = float(raw.mean_electrons[1, 0]), gain * ratio / 2.96
        codes = raw.dn[1::2, 0::2].astype(float)
        read_dn2 = (own_gain * 3.05 / ratio) ** 2 + 1.223**2 + 1 / 12
        factor = sensor.readings[0 if name == "dark" else 1].factor
        variance = factor**2 * (own_gain**2 * mean_e + read_dn2) + (0.0 if name == "dark" else 1 / 12)
        checks[name, "mean"] = mean_p(codes, float(raw.noise_free_dn[1, 0]), variance)
        checks[name, "variance"] = variance_p(codes, variance)
    accept(checks)
