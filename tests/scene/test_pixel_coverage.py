"""Shares of pixels under lines and disks are areas: those of closed forms, and of many samples."""

import math

import numpy as np
import pytest

from simulator.scene.pixel_coverage import disk_coverage, half_plane_coverage

FINE = 64  # samples of a pixel and axis


def sampled(inside, width: int, height: int) -> np.ndarray:
    """Shares of pixels by samples in a lattice."""
    y, x = (np.mgrid[: height * FINE, : width * FINE] + 0.5) / FINE
    return inside(x, y).reshape(height, FINE, width, FINE).mean(axis=(1, 3))


@pytest.mark.parametrize(
    ("x", "y", "radius"),
    [(5.3, 4.7, 3.9), (5.0, 5.0, 3.0), (4.5, 4.5, 0.4), (5.01, 4.3, 0.75), (2.0, 8.0, 6.5), (5.0, 5.0, 40.0)],
)
def test_a_disk_covers_its_area(x, y, radius):
    found = disk_coverage(x, y, radius, 0, 0, 10, 9)
    # The rim crosses a pixel in a length of at most pi, and each row of samples is wrong by less than one sample.
    assert np.abs(found - sampled(lambda u, v: (u - x) ** 2 + (v - y) ** 2 < radius**2, 10, 9)).max() < 2.0 / FINE
    if radius < 4.0:
        assert found.sum() == pytest.approx(math.pi * radius**2, rel=1e-12)
    shifted = disk_coverage(x + 100.0, y - 50.0, radius, 100, -50, 10, 9)
    assert shifted == pytest.approx(found, abs=1e-12)


def test_a_pixel_cut_by_a_quarter_disk_is_pi_over_4():
    assert disk_coverage(0.0, 0.0, 1.0, 0, 0, 1, 1)[0, 0] == pytest.approx(math.pi / 4, rel=1e-14)
    assert disk_coverage(0.0, 0.0, math.sqrt(2.0), 0, 0, 1, 1)[0, 0] == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, -12.0, 30.0, 45.0, 90.0])
def test_a_half_plane_covers_its_area(angle_deg):
    """A closed form at 45 degrees: a corner at distance d is a triangle of area (sqrt(1/2) - d)^2."""
    angle = math.radians(angle_deg)
    y, x = np.mgrid[:8, :8] + 0.5

    def distance(u, v):
        return (u - 4.1) * math.cos(angle) + (v - 3.7) * math.sin(angle)

    found = half_plane_coverage(distance(x, y), angle_deg)
    assert np.abs(found - sampled(lambda u, v: distance(u, v) > 0, 8, 8)).max() < 1.0 / FINE
    if angle_deg == 45.0:
        assert half_plane_coverage(np.array([-0.5]), 45.0)[0] == pytest.approx((math.sqrt(0.5) - 0.5) ** 2, rel=1e-12)
