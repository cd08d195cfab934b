"""Patterns of charts have the geometry that docs/scenes.md states, and pixels are means over their areas."""

import math

import numpy as np
import pytest

from simulator.scene.chart_patterns import STAR_SHARE, centres, dots, siemens_star, slanted_edge, zone_plate

FINE = 16


def sampled(pattern, width: int, height: int) -> np.ndarray:
    """Means over pixels by samples in a lattice; the pattern is a function of x and y from the middle."""
    y, x = (np.mgrid[: height * FINE, : width * FINE] + 0.5) / FINE
    return pattern(x - 0.5 * width, y - 0.5 * height).reshape(height, FINE, width, FINE).mean(axis=(1, 3))


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, -20.0, 44.0])
def test_the_edge_runs_through_the_middle_at_its_angle(angle_deg):
    found = slanted_edge(45, 30, angle_deg)
    angle = math.radians(angle_deg)
    truth = sampled(lambda x, y: 1.0 * (x * math.cos(angle) + y * math.sin(angle) > 0), 45, 30)
    assert np.abs(found - truth).max() < 1.0 / FINE
    places = 45 - found.sum(axis=1)  # x at which each row turns bright
    assert np.diff(places) == pytest.approx(-math.tan(angle), abs=1e-9)
    assert places.mean() == pytest.approx(22.5, abs=1e-9)


def test_the_star_has_its_number_of_periods_and_is_grey_in_the_middle_and_outside():
    width, height, spokes = 240, 160, 36
    found = siemens_star(width, height, spokes)
    truth = sampled(
        lambda x, y: 0.5 + 0.5 * np.cos(spokes * np.arctan2(y, x)) * (np.hypot(x, y) < STAR_SHARE * height), width, height
    )
    radius = np.hypot(*centres(width, height))
    grey = radius < spokes / math.pi  # half a period is a pixel: frequency 1/2 at r = spokes / pi
    assert (found[grey] == 0.5).all() and found[radius > STAR_SHARE * height + 1] == pytest.approx(0.5, abs=1e-9)
    inside = ~grey & (radius < STAR_SHARE * height - 1)
    error = np.abs(found - truth)
    assert error[inside].max() < 0.002 and error[~grey].max() < 0.01  # the rule is of first order
    around = np.array(
        [found[int(80 + 60 * math.sin(t)), int(120 + 60 * math.cos(t))] for t in np.linspace(0, 2 * math.pi, 4096, False)]
    )
    assert np.argmax(np.abs(np.fft.rfft(around - around.mean()))) == spokes


@pytest.mark.parametrize("frequency", [6.0, 20.0, 29.0])
def test_the_zone_plate_is_exact_and_has_its_frequency_at_half_the_height(frequency):
    width, height = 60, 40
    k = frequency / width / (height / 2)
    truth = sampled(lambda x, y: 0.5 + 0.5 * np.cos(math.pi * k * (x**2 + y**2)), width, height)
    assert np.abs(zone_plate(width, height, frequency) - truth).max() < 2e-3  # of the samples, (pi f / FINE)^2 / 24
    # The phase pi k r^2 grows by 2 pi f within a pixel at r = height / 2: f cycles per pixel, f width cycles per width.
    r = 0.5 * height
    assert (math.pi * k * ((r + 0.5) ** 2 - (r - 0.5) ** 2)) / (2 * math.pi) * width == pytest.approx(frequency)


def test_dots_have_their_area_and_lie_in_a_square_lattice():
    width, height, columns, diameter = 300, 200, 12, 0.5
    found = 1.0 - dots(width, height, columns, diameter)
    pitch = width / columns
    assert found.sum() == pytest.approx(columns * 8 * math.pi * (0.25 * pitch) ** 2, rel=1e-12)
    x, y = centres(width, height)
    for row in range(8):
        for column in range(12):
            box = slice(round(row * pitch), round((row + 1) * pitch)), slice(round(column * pitch), round((column + 1) * pitch))
            weight = found[box].sum()
            place = (found[box] * x[:, box[1]]).sum() / weight, (found[box] * y[box[0]]).sum() / weight
            assert place == pytest.approx(((column - 5.5) * pitch, (row - 3.5) * pitch), abs=1e-9)
