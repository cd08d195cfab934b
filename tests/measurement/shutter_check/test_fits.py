"""Fits of bands, boxes and edges on arrays whose truth is known."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from simulator.measurement.shutter_check.exposed_time import effective_share
from simulator.measurement.shutter_check.fits import box_sum_share, fit_linear, overlap
from simulator.measurement.shutter_check.flash_band import measure_band
from simulator.measurement.shutter_check.lamp import measure_depth, measure_scan
from simulator.measurement.shutter_check.moving_edge import edge_places, measure_blur
from simulator.measurement.shutter_check.scan import crossing_share, crossing_speed
from simulator.measurement.shutter_check.shake import crossings

PLACE = (np.arange(400) + 0.5) / 400
NOISE = 0.002


def noise(seed, shape=PLACE.shape):
    return NOISE * np.random.default_rng(seed).standard_normal(shape)


def p_value(measured, truth, error):
    return float(2.0 * stats.norm.sf(abs(measured - truth) / error))


@pytest.mark.parametrize("bend", [-0.6, 0.0, 1.0])
def test_a_crossing_inverts_the_way_of_an_accelerated_edge(bend):
    when = crossing_share(PLACE, bend)
    assert np.allclose((1.0 - bend) * when + bend * when**2, PLACE, atol=1e-12)
    assert np.allclose(crossing_speed(PLACE, bend), 1.0 - bend + 2.0 * bend * when, atol=1e-12)


@pytest.mark.parametrize("bend", [0.0, 0.4])
def test_bands_of_a_lamp_tell_time_acceleration_and_depth(bend):
    """A lamp of 200 Hz over a scan of 37 ms, 7.4 bands, whose depth is 0.3."""
    light = 5.0 * (1.0 + 0.3 * np.cos(2.0 * np.pi * 7.4 * crossing_share(PLACE, bend) + 1.0)) + noise(1)
    found = measure_scan(PLACE, light, 200.0, has_bend=bend > 0)
    later = 5.0 * (1.0 - 0.1 * np.cos(2.0 * np.pi * (7.4 * crossing_share(PLACE, bend) + 0.2) + 1.0)) + noise(2)
    depth, error = measure_depth(PLACE, later, found, 200.0, 0.001)
    tests = {"time": p_value(found.time_s, 0.037, found.time_error_s), "depth": p_value(depth, -0.1, error)}
    if bend:
        tests["bend"] = p_value(found.bend, bend, found.bend_error)
    accept(tests)
    assert found.time_error_s < 1e-5 and error < 1e-4


def test_a_flash_leaves_a_trapezoid():
    light = overlap(PLACE - 0.51, 0.2, 0.07) / 0.07 + noise(3)
    band = measure_band(PLACE, light)
    accept({"height": p_value(band.height, 0.27, band.height_error), "ramp": p_value(band.ramp, 0.07, band.ramp_error)})
    assert band.height_error < 1e-3


def test_boxes_in_a_chain_are_their_convolution():
    x, step = np.linspace(-8.0, 8.0, 16001, retstep=True)
    density = np.array([1.0])
    for width in (3.0, 1.0, 0.5):
        density = np.convolve(density, np.ones(round(width / step) + 1) / (round(width / step) + 1))
    share = np.cumsum(density)
    places = (np.arange(share.size) - 0.5 * (share.size - 1) + 0.5) * step
    assert np.abs(box_sum_share(places, [3.0, 1.0, 0.5]) - share).max() < 1e-3
    assert box_sum_share(np.array([-9.0, 0.0, 9.0]), [3.0, np.full(3, 2.0)]) == pytest.approx([0.0, 0.5, 1.0])


@pytest.mark.parametrize(("penumbra", "aperture"), [(0.0, 0.0), (1.5, 0.0), (1.5, 1.0)])
def test_an_edge_tells_place_and_blur(penumbra, aperture):
    places = 30.0 + 12.0 * PLACE
    boxes = [6.0, *filter(None, (penumbra, aperture))]
    light = 1.0 - box_sum_share(np.arange(72) + 0.5 - places[:, None], boxes) + noise(4, (400, 72))
    found = edge_places(light)
    line = fit_linear(np.stack([np.ones(400), PLACE], axis=1), found)
    blur = measure_blur(light, line.fitted, penumbra, 5.0, aperture)
    accept(
        {
            "skew": p_value(line.values[1], 12.0, line.errors()[1]),
            "blur": p_value(blur.values[0], 6.0, blur.errors()[0]),
        }
    )
    assert line.errors()[1] < 0.01 and blur.errors()[0] < 0.01


def test_the_extent_of_a_profile_is_between_two_of_its_levels():
    profile = np.clip(1.0 - (np.arange(50) - 10.0) / 20.0, 0.0, 1.0)
    extent, error = crossings(profile, 0.01)
    assert extent == pytest.approx(18.0) and 0.1 < error < 0.3


def test_the_effective_time_needs_no_exact_shutter():
    """All exposures lose 1 ms."""
    times_s = 0.004, 0.01, 0.02
    short, middle, long = (np.full(3, 7e4 * (time_s - 0.001)) for time_s in times_s)
    assert effective_share(short, middle, long, times_s) == pytest.approx(0.75)
