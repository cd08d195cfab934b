"""Light in pulses on a path, against dense sums over time in float64."""

import math

import numpy as np
import pytest

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.exposed_light import LightComponent
from simulator.exposure.flash import FlashPulse
from simulator.exposure.line_times import LineTimes
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.optics.geometry.instants import TimedPath

WAY_PX = 30.0  # in a millisecond
MOTION = ImageMotion(ImageGeometry(1000.0, 64, 48), (Surface(1.0, 1.0),), SteadyMotion(right_m_per_s=WAY_PX))
OPENING_S = 1e-3 * np.array([0.0, 0.4, 0.6, 1.0])  # of a leaf shutter


@pytest.mark.parametrize("decay_s", [0.0, 5e-5], ids=["even", "decay"])
@pytest.mark.parametrize("fires_s", [-1e-4, 5e-5, 3e-4, 5e-4, 7e-4, 9e-4])
def test_a_flash_on_a_ramp_of_the_shutter_weighs_the_path(fires_s, decay_s):
    """The share of the light that has come along the way."""
    lines = LineTimes("all", *OPENING_S[:, None], np.ones(1))
    pulse = FlashPulse(2.0 + fires_s, 2e-4, decay_s)
    component = LightComponent(True, pulse, (lines,), 2.0, 1e-3)
    path = TimedPath(MOTION, component.lit_openings(), component.release_s, component.curve)
    instants = path.of_shift().instants(512)
    times_s = (np.arange(1_000_000) + 0.5) * 1e-9
    light = np.interp(times_s, OPENING_S, [0.0, 1.0, 1.0, 0.0]) * pulse.brightness(2.0 + times_s)
    moved = 1e3 * WAY_PX * (times_s - np.average(times_s, weights=light))
    assert instants.weights.sum() == pytest.approx(1.0)
    places = instants.pose_numbers[0, :, 0]
    places = np.sign(places[-1] - places[0]) * (places - instants.weights[0] @ places)
    for edge_px in np.linspace(-3.0, 3.0, 25):
        dense = np.average(np.clip(moved - edge_px, -0.5, 0.5), weights=light)
        assert math.isclose(np.clip(places - edge_px, -0.5, 0.5) @ instants.weights[0], dense, abs_tol=1e-3)
