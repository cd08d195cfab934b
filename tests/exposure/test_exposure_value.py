"""Exposure arithmetic, against the values that colour-hdri (BSD-3) prints for its functions of ISO 2720 and ISO 12232."""

import math

import pytest

from simulator.exposure.exposure_value import (
    aperture_value,
    exposure_value,
    exposure_value_100,
    exposure_value_of_luminance,
    focal_plane_exposure_lx_s,
    metered_illuminance_lx,
    metered_luminance_cd_m2,
    q_factor,
    speed_value,
    time_value,
)


def test_the_q_factor_is_that_of_the_standard():
    assert q_factor() == pytest.approx(0.6515748, abs=1e-7)
    assert q_factor(1.0, 1.0, 0.0) == math.pi / 4


def test_exposure_at_the_focal_plane():
    """colour_hdri.focal_plane_exposure(4000, 8, 1 / 250, 0.05, 0.05, 0.0015)."""
    assert focal_plane_exposure_lx_s(4000, 8, 1 / 250, flare_lx_s=0.0015) == pytest.approx(0.1643937, abs=1e-7)
    twice = focal_plane_exposure_lx_s(4000, 8, 1 / 250, extension=2.0)  # 1:1: the image lies at 2 f
    assert twice == pytest.approx(focal_plane_exposure_lx_s(4000, 8, 1 / 250) / 4)


def test_exposure_value_at_iso_100():
    assert exposure_value_100(8, 1 / 250, 400) == pytest.approx(11.9657842, abs=1e-7)
    assert exposure_value(1, 1) == 0 and exposure_value(16, 1 / 128) == 15  # sunny 16


def test_luminance_and_illuminance_of_a_setting():
    assert metered_luminance_cd_m2(8, 1, 100) == pytest.approx(8.0)
    assert metered_illuminance_lx(8, 1, 100) == pytest.approx(160.0)
    assert metered_luminance_cd_m2(8, 1, 100, k=14.0) == pytest.approx(8.96)
    assert exposure_value_of_luminance(0.125) == 0.0  # EV 0 at K 12.5


def test_the_additive_system_adds_up():
    """Av + Tv = Bv + Sv, Bv = log2 of the luminance over 3.125 K."""
    f_number, time_s, iso = 5.6, 1 / 60, 800
    brightness = math.log2(metered_luminance_cd_m2(f_number, time_s, iso) * 3.125 / 12.5)
    assert aperture_value(f_number) + time_value(time_s) == pytest.approx(brightness + speed_value(iso))
    assert speed_value(100) == 5.0


def test_a_metered_surface_gets_the_exposure_of_the_standard_s_grey():
    """q K / ISO = 8.14 lx s / ISO; the standard's 10 lx s is for K = 15.4."""
    luminance = metered_luminance_cd_m2(4, 1 / 30, 200)
    assert focal_plane_exposure_lx_s(luminance, 4, 1 / 30) == pytest.approx(q_factor() * 12.5 / 200)
