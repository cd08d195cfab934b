"""Two read-noise sources and a conversion gain make the noise against ISO that one source cannot."""

import math

import pytest
from helpers.camera_builders import small_camera

from simulator.errors import PhotositeError
from simulator.sensor.camera.camera_sections import ConversionGainSwitch, IsoSetting
from simulator.sensor.camera.read_noise_model import ReadNoiseModel

MODEL = ReadNoiseModel(gain_at_iso_100_dn_per_e=0.2, before_gain_e=4.0, after_gain_dn=1.5, lowest_iso=100, highest_iso=25600)


def camera(**settings):
    settings = {"iso_table": {}, "read_noise_model": MODEL, "conversion_gain": ConversionGainSwitch(1600, 4.0)} | settings
    return small_camera(**settings)


@pytest.mark.parametrize("iso", [100, 320, 1599, 1600, 12800, 25600])
def test_the_two_sources_add_up_in_quadrature_and_the_ratio_divides_the_first(iso):
    setting, ratio = camera().iso_setting(iso), 4.0 if iso >= 1600 else 1.0
    gain = 0.2 * iso / 100
    assert setting.gain_dn_per_e == pytest.approx(gain)
    sigma_e = setting.read_noise_dn / setting.gain_dn_per_e
    assert sigma_e**2 == pytest.approx((4.0 / ratio) ** 2 + (1.5 / gain) ** 2)


def test_the_gain_is_continuous_at_the_switch_and_the_noise_is_not():
    low, high = camera().iso_setting(1599.999), camera().iso_setting(1600)
    assert low.gain_dn_per_e == pytest.approx(high.gain_dn_per_e, rel=1e-5)
    assert low.read_noise_dn / high.read_noise_dn == pytest.approx(math.hypot(12.8, 1.5) / math.hypot(3.2, 1.5), rel=1e-5)


def test_below_the_switch_its_stages_are_the_two_sources():
    stages = camera().sensor_stages(400, 0.1)
    assert stages["read_noise_before_gain"].sigma_e == pytest.approx(4.0)
    assert stages["read_noise_after_gain"].sigma_dn == 1.5
    assert "conversion_gain" not in stages


def test_from_the_switch_on_they_stand_behind_the_higher_conversion_gain():
    stages = camera().sensor_stages(3200, 0.1)
    assert stages["conversion_gain"].ratio == 4.0
    assert stages["read_noise_before_gain"].sigma_e == pytest.approx(4.0)  # counted in electrons of low conversion gain
    assert stages["analog_gain"].gain_dn_per_e == pytest.approx(0.2 * 32 / 4.0)
    assert stages["read_noise_after_gain"].sigma_dn == 1.5


def test_the_range_is_refused_beyond_and_extrapolated_when_asked():
    message = (
        "exposure.iso = 50: the read noise of the Photosite test is stated for 100 to 25600; .* camera.iso_range: extrapolate"
    )
    with pytest.raises(PhotositeError, match=message):
        camera().iso_setting(50)
    assert camera(iso_range="extrapolate").iso_setting(50).gain_dn_per_e == pytest.approx(0.1)


def test_its_isos_are_the_full_stops():
    assert camera().isos == (100, 200, 400, 800, 1600, 3200, 6400, 12800, 25600)


REFUSED = {
    "camera.iso_table = 1 lines: a camera has a read_noise_model or a table": dict(iso_table={100: IsoSetting(1.0, 0.0)}),
    "camera.read_noise_after_gain = 1 DN: a read_noise_model has its own": dict(read_noise_after_gain_dn=1.0),
    "camera.conversion_gain.ratio = None: a read_noise_model needs": dict(conversion_gain=ConversionGainSwitch(1600)),
    "camera.iso_table = {}: give at least one line .* or a read_noise_model": dict(read_noise_model=None),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_camera_has_one_form_of_read_noise(message):
    with pytest.raises(PhotositeError, match=message):
        camera(**REFUSED[message])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0.0, 1.0, 1.0, 100, 200), "gain_at_iso_100 = 0 DN/e-"),
        ((1.0, -1.0, 1.0, 100, 200), "before_gain = -1 e-"),
        ((1.0, 1.0, math.nan, 100, 200), "after_gain = nan DN"),
        ((1.0, 1.0, 1.0, 0, 200), "lowest_iso = 0"),
        ((1.0, 1.0, 1.0, 200, 200), "highest_iso = 200: is not above lowest_iso = 200"),
    ],
)
def test_its_numbers_are_checked(values, message):
    with pytest.raises(PhotositeError, match=message):
        ReadNoiseModel(*values)
