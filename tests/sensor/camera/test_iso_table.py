"""Between measured ISOs a camera follows straight lines in log-log; never across a conversion-gain switch, never beyond."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.errors import PhotositeError
from simulator.sensor.camera.camera_sections import ConversionGainSwitch, IsoSetting
from simulator.sensor.stages.row_noise import RowNoise

BIAS = (1.0, 2.0, 3.0, 4.0)


def line(gain, noise, shape=-0.1, row=0.5, **levels):
    return IsoSetting(gain, noise, shape, row, tuple(gain * bias for bias in BIAS), **levels)


LINES = {
    100: line(0.1, 1.0, 0.1, 0.2, black_level_dn=512.0, white_level_dn=14008.0),
    400: line(0.5, 3.0, -0.1, 0.8, black_level_dn=2048.0, white_level_dn=14448.0),
    800: line(0.9, 5.0, -0.2, 1.1),
    1600: line(1.6, 2.0, 0.0, 0.3),
    3200: line(3.2, 3.0, -0.1, 0.4),
}


def camera(**settings):
    defaults = {"cfa": "RGGB", "bit_depth": 14, "black_level_dn": 64.0, "iso_table": LINES}
    settings = defaults | {"conversion_gain": ConversionGainSwitch(1600)} | settings
    return small_camera(**settings)


@pytest.mark.parametrize("iso", LINES)
def test_a_measured_iso_is_the_measured_line(iso):
    found, measured = camera().iso_setting(iso), LINES[iso]
    for name in ("gain_dn_per_e", "read_noise_dn", "tukey_lambda", "row_noise_dn", "color_bias_dn"):
        assert getattr(found, name) == getattr(measured, name)


@pytest.mark.parametrize(("iso", "low", "high"), [(110, 100, 400), (200, 100, 400), (500, 400, 800), (2500, 1600, 3200)])
def test_gain_and_noises_are_straight_in_log_log_between_measured_isos(iso, low, high):
    found = camera().iso_setting(iso)
    for name in ("gain_dn_per_e", "read_noise_dn", "row_noise_dn"):
        ends = [getattr(LINES[end], name) for end in (low, high)]
        expected = math.exp(np.interp(math.log(iso), np.log([low, high]), np.log(ends)))
        assert getattr(found, name) == pytest.approx(expected, rel=1e-12)


def test_shape_and_color_bias_are_straight_in_the_logarithm_of_the_iso():
    found = camera().iso_setting(200)  # half way from 100 to 400
    assert found.tukey_lambda == pytest.approx(0.0, abs=1e-12)
    assert found.color_bias_dn == pytest.approx([0.3, 0.6, 0.9, 1.2])


LEVELS = {100: (512, 14008), 199: (512, 14008), 200: (512, 14008), 201: (2048, 14448)}  # 200 is equally near to both


@pytest.mark.parametrize(("iso", "levels"), LEVELS.items())
def test_black_and_white_are_those_of_the_nearest_measured_iso(iso, levels):
    found = camera().iso_setting(iso)
    assert (found.black_level_dn, found.white_level_dn) == levels


def test_a_line_without_levels_has_the_levels_of_the_camera():
    found = camera().iso_setting(800)
    assert (found.black_level_dn, found.white_level_dn) == (64.0, 2**14 - 1)
    assert camera(white_level_dn=15520.0).iso_setting(800).white_level_dn == 15520.0


@pytest.mark.parametrize("iso", [50, 99, 801, 1000, 1599, 3201])
def test_an_iso_beyond_the_measured_ones_of_its_side_is_refused(iso):
    message = (
        f"exposure.iso = {iso}: the Photosite test was not measured there, but at 100 to 800 and 1600 to 3200; give an ISO "
    )
    with pytest.raises(PhotositeError, match=message + "within, or set camera.iso_range: extrapolate"):
        camera().iso_setting(iso)


@pytest.mark.parametrize(("iso", "low", "high"), [(50, 100, 400), (1200, 400, 800), (6400, 1600, 3200)])
def test_when_asked_the_slope_of_the_last_two_lines_of_that_side_goes_on(iso, low, high):
    found = camera(iso_range="extrapolate").iso_setting(iso)
    share = math.log(iso / low) / math.log(high / low)
    for name in ("gain_dn_per_e", "read_noise_dn", "row_noise_dn"):
        first, second = (getattr(LINES[end], name) for end in (low, high))
        assert getattr(found, name) == pytest.approx(first * (second / first) ** share, rel=1e-12)
    nearest = LINES[min(LINES, key=lambda known: abs(math.log(known / iso)) if (known < 1600) == (iso < 1600) else 99)]
    assert found.tukey_lambda == pytest.approx(nearest.tukey_lambda)
    assert found.color_bias_dn == pytest.approx(nearest.color_bias_dn)


def test_without_a_switch_the_table_is_one():
    lines = {iso: LINES[iso] for iso in (800, 1600)}
    found = camera(iso_table=lines, conversion_gain=None).iso_setting(800 * math.sqrt(2))
    assert found.read_noise_dn == pytest.approx(math.sqrt(10.0))


def test_no_noise_stays_no_noise():
    lines = {100: IsoSetting(1.0, 0.0), 400: IsoSetting(4.0, 0.0), 1600: IsoSetting(16.0, 2.0)}
    table = camera(iso_table=lines, conversion_gain=None)
    assert table.iso_setting(200).read_noise_dn == 0.0
    assert table.iso_setting(800).read_noise_dn == pytest.approx(1.0)  # 0 has no logarithm: half way in ln ISO
    assert set(table.sensor_stages(200, 0.1)) == {"analog_gain", "adc"}


REFUSED = {
    "camera.iso_table = 200: has no tukey_lambda": dict(iso_table=LINES | {200: IsoSetting(1.0, 1.0, None, 0.0, BIAS)}),
    "camera.iso_table = 200: has no color_bias": dict(iso_table=LINES | {200: IsoSetting(1.0, 1.0, 0.1)}),
    "camera.conversion_gain.ratio = 4.0: the lines hold": dict(conversion_gain=ConversionGainSwitch(1600, 4.0)),
    "camera.conversion_gain.iso = 100: needs measured lines on both": dict(conversion_gain=ConversionGainSwitch(100)),
    "camera.conversion_gain.iso = 6400: needs measured": dict(conversion_gain=ConversionGainSwitch(6400)),
    "camera.read_noise_after_gain = 1 DN: the total has the shape": dict(read_noise_after_gain_dn=1.0),
    "camera.iso_table.100.white_level = 20000 DN: .* up to 16383 DN": dict(
        iso_table={100: IsoSetting(1, 0, white_level_dn=2e4)}
    ),
    "camera.iso_table.100.white_level = 60 DN: must lie above the black level, 64 DN": dict(
        iso_table={100: IsoSetting(1, 0, white_level_dn=60.0)}, conversion_gain=None
    ),
    "camera.white_level = 60 DN": dict(white_level_dn=60.0, iso_table={100: IsoSetting(1, 0)}),
    "camera.iso_table.100.row_noise = given: stages.row_noise is given, too": dict(stages={"row_noise": RowNoise(1.0)}),
    "camera.iso_table.100.color_bias = .* MONO": dict(cfa="MONO", iso_table={100: LINES[100]}),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_table_that_contradicts_itself_is_refused(message):
    lines = REFUSED[message].get("iso_table", LINES)
    with pytest.raises(PhotositeError, match=message):
        camera(**({"conversion_gain": None} if len(lines) == 1 else {}) | REFUSED[message])


def test_a_shaped_read_noise_stands_wholly_behind_the_gain_with_its_row_noise():
    stages = camera().sensor_stages(400, 0.1)
    assert "read_noise_before_gain" not in stages
    assert (stages["read_noise_after_gain"].sigma_dn, stages["read_noise_after_gain"].tukey_lambda) == (3.0, -0.1)
    assert stages["row_noise"].sigma_dn == 0.8


PLACES = {"RGGB": (1, 2, 3, 4), "BGGR": (4, 3, 2, 1), "GRBG": (2, 1, 4, 3), "GBRG": (3, 4, 1, 2)}


@pytest.mark.parametrize("cfa", PLACES)
def test_color_bias_lies_on_the_places_of_its_colors(cfa):
    lines = {100: IsoSetting(1.0, 1.0, color_bias_dn=BIAS)}  # red, green beside red, green beside blue, blue
    stages = camera(cfa=cfa, iso_table=lines, conversion_gain=None).sensor_stages(100, 0.1)
    assert stages["color_bias"].offsets_dn == PLACES[cfa]


def test_one_line_has_no_slope():
    with pytest.raises(PhotositeError, match="exposure.iso = 200: one measured line, at ISO 100, has no slope"):
        small_camera(iso_range="extrapolate").iso_setting(200)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: IsoSetting(1.0, 1.0, -0.5), "iso_table.tukey_lambda = -0.5: give -0.3 to 0.25"),
        (lambda: IsoSetting(1.0, 0.0, 0.1), "iso_table.tukey_lambda = 0.1: there is no read noise"),
        (lambda: IsoSetting(1.0, 1.0, row_noise_dn=-1.0), "iso_table.row_noise = -1 DN"),
        (lambda: ConversionGainSwitch(0), "conversion_gain.iso = 0"),
        (lambda: ConversionGainSwitch(800, 1.0), "conversion_gain.ratio = 1.0"),
    ],
)
def test_a_line_is_checked(make, message):
    with pytest.raises(PhotositeError, match=message):
        make()
