"""Radiance to irradiance: the stage's moments and the lens formulas it takes its number from (R1, R2)."""

import math

import pytest

from simulator.optics.lens.thin_lens import ThinLens
from simulator.sensor.stages.irradiance import Irradiance
from simulator.sensor.stages.stage import Moments


def test_the_two_published_forms_at_f4_and_infinity():
    assert ThinLens(50.0, 4.0).irradiance_per_radiance_sr() == pytest.approx(math.pi / 65.0)  # R1: 0.0483322
    assert ThinLens(50.0, 4.0, irradiance="aplanatic").irradiance_per_radiance_sr() == pytest.approx(math.pi / 64.0)


@pytest.mark.parametrize(
    ("f_number", "ratio"), [(1.0, 1.25), (1.4, 1.128), (2.0, 1.0625), (2.8, 1.032), (4.0, 1.016), (8.0, 1.004)]
)
def test_ratio_of_the_forms(f_number, ratio):
    """R2."""
    thin = ThinLens(50.0, f_number).irradiance_per_radiance_sr()
    aplanatic = ThinLens(50.0, f_number, irradiance="aplanatic").irradiance_per_radiance_sr()
    assert aplanatic / thin == pytest.approx(ratio, rel=1e-3)


def test_focusing_near_costs_light():
    """At magnification 1 the working f-number doubles: a quarter of the light (aplanatic form)."""
    far, near = (ThinLens(50.0, 8.0, d, irradiance="aplanatic").irradiance_per_radiance_sr() for d in (math.inf, 0.1))
    assert far / near == pytest.approx(4.0)


def test_moments_scale_with_the_solid_angle():
    assert Irradiance(0.5, 0.0, 0.0, 0.0).moments(Moments(4.0, 8.0)) == Moments(2.0, 2.0)
