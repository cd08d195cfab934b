"""Light in pulses on a path, against dense sums over time in float64."""

import math

import numpy as np
import pytest

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.exposed_light import LightComponent
from simulator.exposure.flash import FlashPulse
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.optics.geometry.instants import TimedPath, instants_error

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


def seen(places_px: np.ndarray, weights: np.ndarray, edges_px: np.ndarray) -> np.ndarray:
    """Light of edges that pass at places, on a photosite's even square."""
    return np.array([np.clip(edge - places_px, -0.5, 0.5) @ weights for edge in edges_px])


@pytest.mark.parametrize(
    "lamp",
    [
        PwmLamp(1000.0, 0.05),
        PwmLamp(1000.0, 0.01, 90.0),
        PwmLamp(80_000.0, 0.1),
        PwmLamp(500_000.0, 0.1),
        MainsFlicker(3000.0, 1.0),
    ],
    ids=["one pulse", "one short pulse", "80 pulses", "500 pulses", "mains"],
)
@pytest.mark.parametrize("count", [40, 150, 400])
def test_the_law_of_instants_bounds_the_error_under_light_that_is_not_even(lamp, count):
    path = TimedPath(MOTION, open_at_once(1e-3), 2.0, lamp)
    instants = path.of_shift().instants(count)
    times_s = (np.arange(200_000) + 0.5) * 5e-9
    light = lamp.brightness(2.0 + times_s).astype(np.float64)
    moved = 1e3 * WAY_PX * (2.0 + times_s)
    places = np.abs(instants.pose_numbers[0, :, 0])
    edges = moved[0] + np.linspace(-1.0, WAY_PX + 1.0, 801)
    error = np.abs(seen(places, instants.weights[0], edges) - seen(moved, light / light.sum(), edges)).max()
    assert error <= path.instants_error(count, path.length, 1.0) + 2e-6


def test_a_line_whose_storage_leaks_for_long_keeps_the_law():
    """A millisecond of light, then a thousandth of it for twenty."""
    times = [np.array([value]) for value in (0.0, 1e-3, 21e-3)]
    main = LineTimes("all", times[0], times[0], times[1], times[1], np.ones(1))
    leak = LineTimes("all", times[1], times[1], times[2], times[2], np.full(1, 1e-3))
    path = TimedPath(MOTION, (main, leak), 0.0)
    instants = path.of_shift().instants(400)
    times_s = (np.arange(420_000) + 0.5) * 5e-8
    light = np.where(times_s < 1e-3, 1.0, 1e-3)
    moved, edges = 1e3 * WAY_PX * times_s, np.linspace(-1.0, WAY_PX + 2.0, 301)
    places = np.abs(instants.pose_numbers[0, :, 0])
    error = np.abs(seen(places, instants.weights[0], edges) - seen(moved, light / light.sum(), edges)).max()
    assert error <= instants_error(400, path.length, 1.0)
