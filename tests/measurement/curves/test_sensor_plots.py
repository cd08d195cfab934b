"""Plots of a camera: closed forms of a camera of shot and read noise."""

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.hdr_bench import SHOT_NOISE

from simulator.config import load_camera
from simulator.measurement.curves.sensor_plots import (
    CameraSetting,
    dynamic_range_plot,
    noise_plot,
    photon_transfer_plot,
    snr_plot,
    spread_isos,
)
from simulator.sensor.camera.camera import IsoSetting

LINES = {100: IsoSetting(0.25, 3.0), 400: IsoSetting(1.0, 6.0), 1600: IsoSetting(4.0, 20.0)}
CAMERA = small_camera(iso_table=LINES, stages=SHOT_NOISE, black_level_dn=500.0)
SETTING = CameraSetting.of(CAMERA, 0.01)


def rounded(setting: IsoSetting) -> float:
    return setting.read_noise_dn**2 + 1.0 / 12.0


def test_snr_is_the_closed_form_at_each_iso():
    plot = snr_plot(SETTING)
    assert [line.label for line in plot.lines] == ["ISO 100", "ISO 400", "ISO 1600"]
    for line, setting in zip(plot.lines, LINES.values(), strict=True):
        electrons = line.curve.x / line.curve.x[0] * 0.1
        wanted = electrons / np.sqrt(electrons + rounded(setting) / setting.gain_dn_per_e**2)
        assert line.curve.y == pytest.approx(wanted, rel=1e-7)
    assert (plot.lines[0].curve.x_unit, plot.lines[0].curve.y_unit) == ("lx s", "")


def test_a_camera_blind_to_daylight_has_its_snr_over_electrons():
    from simulator.sensor.camera.camera import SpectralResponse

    infrared = SpectralResponse(np.array([900.0, 950.0, 1000.0]), np.ones((3, 1)))
    blind = small_camera(iso_table=LINES, stages=SHOT_NOISE, response=infrared)
    curve = snr_plot(CameraSetting.of(blind, 0.01, (100,))).lines[0].curve
    assert (curve.x_name, curve.x_unit) == ("signal", "e-") and curve.x[0] == pytest.approx(0.1)


def test_photon_transfer_is_the_closed_form():
    for line, setting in zip(photon_transfer_plot(SETTING).lines, LINES.values(), strict=True):
        wanted = np.sqrt(setting.gain_dn_per_e * line.curve.x + rounded(setting))
        assert line.curve.y == pytest.approx(wanted, rel=1e-7)


def test_noise_and_dynamic_range_over_iso_are_those_of_the_table():
    noise, stops = noise_plot(SETTING).lines[0].curve, dynamic_range_plot(SETTING).lines[0].curve
    dark_dn = np.sqrt([rounded(setting) for setting in LINES.values()])
    gain = np.array([setting.gain_dn_per_e for setting in LINES.values()])
    assert noise.x.tolist() == stops.x.tolist() == [100.0, 400.0, 1600.0]
    assert noise.y == pytest.approx(dark_dn / gain, rel=1e-12)
    least_e = 0.5 + np.sqrt((dark_dn / gain) ** 2 + 0.25)  # n / sqrt(n + sigma^2) = 1
    assert stops.y == pytest.approx(np.log2((65535.0 - 500.0) / gain / least_e), rel=1e-6)


def test_the_photographic_range_ends_at_an_snr_of_20_in_the_circle_of_confusion():
    """Photosites of 5 um on 36 mm x 24 mm: the diagonal / 1291 is the circle c, and 20 / (sqrt(pi) / 2 c / p) the SNR."""
    large = small_camera(7200, 4800, iso_table=LINES, stages=SHOT_NOISE, black_level_dn=500.0)
    photographic = dynamic_range_plot(CameraSetting.of(large, 0.01)).lines[1].curve
    snr = 20.0 / (np.sqrt(np.pi) / 2.0 * np.hypot(36e3, 24e3) / 1291.0 / 5.0)
    for stops, setting in zip(photographic.y, LINES.values(), strict=True):
        least_e = 0.5 * snr**2 + np.sqrt(snr**2 * rounded(setting) / setting.gain_dn_per_e**2 + 0.25 * snr**4)
        full_e = (65535.0 - 500.0) / setting.gain_dn_per_e
        assert stops == pytest.approx(np.log2(full_e / least_e), rel=1e-6)


def test_longer_exposures_have_more_noise_of_the_dark():
    camera = load_camera("sony_a7s2", ["camera.stages.dark_current={rate: 10 e-/s}"])
    short, long = (noise_plot(CameraSetting.of(camera, time_s)).lines[0].curve.y for time_s in (0.01, 10.0))
    assert long**2 - short**2 == pytest.approx(10.0 * 9.99, rel=1e-3)


def test_isos_are_spread_in_even_ratios_with_both_ends():
    assert spread_isos((50, 64, 80, 100, 200, 400, 800, 1600, 3200), 3) == (50, 400, 3200)
    assert spread_isos((100,), 5) == (100,)
