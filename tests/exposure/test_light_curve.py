"""What lines collect of a light is the integral of opening times light: against quadrature in float64."""

import numpy as np
import pytest

from simulator.exposure.flash import FlashPulse
from simulator.exposure.flicker import Harmonic, MainsFlicker, PwmLamp
from simulator.exposure.light_curve import SteadyLight, collect
from simulator.exposure.line_times import LineTimes

RELEASE_S = 0.0123
MAINS = MainsFlicker(100.0, 0.4, 30.0, (Harmonic(2, 0.2, 70.0),))
LAMP, PULSE = PwmLamp(240.0, 0.3, 50.0), FlashPulse(0.0301, 0.001, 0.002)
# Four lines: a box, a trapezoid, a triangle, a step followed by a ramp.
LINES = LineTimes(
    "rows",
    *(np.array(times) for times in ((0.0, 0.002, 0.01, 0.015), (0.0, 0.005, 0.02, 0.015), (0.02, 0.02, 0.02, 0.015))),
    np.array([0.02, 0.021, 0.03, 0.03]),
    np.array([1.0, 0.5, 1.0, 0.7]),
)
BRIGHTNESS = {
    "steady": (SteadyLight(), lambda t: np.ones_like(t)),
    "mains": (
        MAINS,
        lambda t: 1 + 0.4 * np.cos(628.318530718 * t + np.pi / 6) + 0.2 * np.cos(1256.637061436 * t + 7 * np.pi / 18),
    ),
    "pulses": (LAMP, lambda t: ((240.0 * t + 50 / 360) % 1.0 < 0.3) / 0.3),
    "flash": (
        PULSE,
        lambda t: np.where(t < 0.0301, 0.0, np.exp(-np.maximum(t - 0.0311, 0.0) / 0.002)) / 0.003,
    ),
}


def opening(line: int, t: np.ndarray) -> np.ndarray:
    """Share of the light that passes over a line at these times after the release."""
    a, b, c, d = (float(times[line]) for times in (LINES.opens_s, LINES.open_s, LINES.closes_s, LINES.closed_s))
    rising = np.clip((t - a) / (b - a), 0, 1) if b > a else (t >= a) * 1.0
    falling = np.clip((d - t) / (d - c), 0, 1) if d > c else (t < d) * 1.0
    return LINES.peak[line] * np.minimum(rising, falling)


def quadrature(light, line: int, until_s: np.ndarray) -> np.ndarray:
    """Midpoints of 3e5 intervals of 0.1 us, up to some instants."""
    edges = np.linspace(0.0, 0.03, 300_001)
    t = 0.5 * (edges[1:] + edges[:-1])
    total = np.concatenate([[0.0], np.cumsum(opening(line, t) * light(RELEASE_S + t))]) * 1e-7
    return np.interp(until_s - RELEASE_S, edges, total)


@pytest.mark.parametrize("name", BRIGHTNESS)
def test_lines_collect_the_integral_of_opening_times_light(name):
    curve, light = BRIGHTNESS[name]
    scale = 1.0 if name == "flash" else 0.01
    instants = RELEASE_S + np.array([-0.1, 0.0, 0.0013, 0.004, 0.0177, 0.0195, 0.0254, 0.03, 0.5])
    whole, parts = collect(curve, LINES, RELEASE_S), collect(curve, LINES, RELEASE_S, instants)
    for line in range(4):
        expected = quadrature(light, line, instants)
        np.testing.assert_allclose(parts[line], expected, atol=2e-4 * scale)
        assert whole[line] == pytest.approx(expected[-1], abs=2e-4 * scale)
    np.testing.assert_allclose(parts[:, -1], whole, atol=1e-12)
    np.testing.assert_array_equal(collect(curve, LINES, RELEASE_S, np.tile(instants, (4, 1))), parts)
    own = RELEASE_S + np.random.default_rng(2).uniform(0.0, 0.03, 200)
    np.testing.assert_allclose(curve.brightness(own), light(own), rtol=1e-9)
    assert (np.diff(parts, axis=1) >= -1e-15).all()


@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0, 2.0, 2.5])
def test_a_box_sees_the_modulation_times_sinc(ratio):
    """m |sinc(f T)|: none where the exposure is whole periods."""
    starts = np.linspace(0.0, 0.01, 4001)
    box = LineTimes("rows", starts, starts, starts + 0.01 * ratio, starts + 0.01 * ratio, np.ones(4001))
    collected = collect(MainsFlicker(100.0, 0.4), box, 0.0) / (0.01 * ratio)
    modulation = 0.5 * np.ptp(collected)
    assert modulation == pytest.approx(0.4 * abs(np.sinc(ratio)), abs=1e-6)
    assert collected[:-1].mean() == pytest.approx(1.0, abs=1e-12)


def test_light_is_conserved_over_a_period_of_pulses():
    starts = np.linspace(0.0, 1 / 240.0, 1001)[:-1]
    box = LineTimes("rows", starts, starts, starts + 0.001, starts + 0.001, np.ones(1000))
    assert collect(LAMP, box, 0.0).mean() == pytest.approx(0.001, rel=1e-6)


def test_a_ramp_as_short_as_rounding_is_a_step():
    for curve in (MAINS, LAMP, PULSE):
        times = np.array([0.01]), np.array([0.01]), np.array([0.025]), np.array([0.025])
        step = collect(curve, LineTimes("all", *times, np.ones(1)), RELEASE_S)
        for width in (1e-13, 1e-10, 3e-9):
            ramp = LineTimes("all", times[0], times[1] + width, times[2], times[3] + width, np.ones(1))
            np.testing.assert_allclose(collect(curve, ramp, RELEASE_S), step, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize(("release_s", "time_s"), [(3600.0, 1e-6), (0.0, 3600.0)])
def test_a_microsecond_after_an_hour_and_an_hour_are_as_exact(release_s, time_s):
    zero, end = np.zeros(1), np.full(1, time_s)
    box = LineTimes("all", zero, zero, end, end, np.ones(1))
    assert collect(SteadyLight(), box, release_s) == pytest.approx([time_s], rel=1e-12)
    mean = collect(MainsFlicker(100.0, 0.4), box, release_s) / time_s
    assert mean == pytest.approx([1.4 if time_s < 1.0 else 1.0], rel=1e-5)


def test_a_light_is_described_with_its_phases():
    """Lights that differ in the picture read differently."""
    assert MAINS.describe() == "1 + 0.4 cos(2 pi 100 Hz t + 30 deg) + 0.2 cos(2 pi 200 Hz t + 70 deg)"
    assert MainsFlicker(100.0, 0.4, -30.0).describe() == "1 + 0.4 cos(2 pi 100 Hz t - 30 deg)"
    assert MainsFlicker(100.0, 0.4).describe() == "1 + 0.4 cos(2 pi 100 Hz t)"
    assert LAMP.describe() == "on for the first 30 % of each 1 / 240 Hz, 50 deg of which have passed when the clock is 0"
    assert PwmLamp(240.0, 0.3).describe() == "on for the first 30 % of each 1 / 240 Hz"
