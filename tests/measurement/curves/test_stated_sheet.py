"""The data sheet of a camera file: its own numbers by the standard's equations, and a camera again when it is read."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.measurement.curves.stated_sheet import stated_sheet
from simulator.measurement.emva1288.xml_sheet import write_xml_sheet
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu

STAGES = {
    "photon_shot_noise": PhotonShotNoise(),
    "dark_current": DarkCurrent(20.0),
    "dsnu": Dsnu(3.0),
    "full_well": FullWell(7000.0),
    "prnu": Prnu(0.01),
}


def mono(**settings):
    """12 bit, K = 0.5, read noise 4 e-, fill factor 0.8."""
    fields = {"bit_depth": 12, "black_level_dn": 100.0, "fill_factor": 0.8, "iso_table": {200: IsoSetting(0.5, 2.0)}}
    return small_camera(96, 64, "MONO", **{**fields, "stages": STAGES, **settings})


def test_the_numbers_are_those_of_the_camera_by_the_standards_equations():
    values = stated_sheet(mono(), 200).values
    expected = {"width": 96, "height": 64, "bit_depth": 12, "K": 0.5, "inverse_K": 2.0, "QE": 80.0, "R": 0.4, "u_e_sat": 7000.0}
    expected |= {"sigma_d": 4.0, "sigma_y_dark": math.sqrt(4.0 + 1 / 12), "u_y_dark": 100.0, "u_I_mean": 20.0, "DSNU1288": 3.0}
    threshold = 2.0 * math.sqrt(4.0 + 1 / 12) + 0.5
    expected |= {"PRNU1288": 1.0, "u_e_min": threshold, "u_p_min": threshold / 0.8, "u_p_sat": 8750.0, "DR": 7000.0 / threshold}
    expected |= {"SNR_max": math.sqrt(7000.0), "SNR_max_dB": 10 * math.log10(7000.0), "u_e_sat_area": 7000.0 / 25.0}
    for name, value in expected.items():
        assert values[name] == pytest.approx(value, rel=1e-5), name


def test_what_a_camera_has_not_is_left_out():
    values = stated_sheet(mono(stages={"photon_shot_noise": PhotonShotNoise()}), 200).values
    assert not {"DSNU1288", "PRNU1288", "u_I_mean"} & set(values)
    assert values["u_e_sat"] == pytest.approx((4095 - 100) / 0.5)


def test_a_camera_comes_back_from_its_sheet(tmp_path):
    write_xml_sheet(stated_sheet(mono(), 200), tmp_path / "sheet.xml")
    back = load_camera(str(tmp_path / "sheet.xml"))
    assert (back.width_px, back.height_px, back.bit_depth, back.cfa, back.isos) == (96, 64, 12, "MONO", (200,))
    assert back.iso_table[200].gain_dn_per_e == pytest.approx(0.5) and back.iso_table[200].read_noise_dn == pytest.approx(2.0)
    assert back.stages["full_well"].capacity_e == 7000.0 and back.stages["dsnu"].sigma_e == pytest.approx(3.0)
    one, two = (stated_sheet(camera, 200, 550.0).values for camera in (mono(), back))
    assert one.keys() == two.keys() and all(two[name] == pytest.approx(value, rel=1e-5) for name, value in one.items())


def test_a_colour_camera_comes_back_with_its_curves(tmp_path):
    camera = load_camera("sony_a7s2")
    write_xml_sheet(stated_sheet(camera, 1600), tmp_path / "sheet.xml")
    back = load_camera(str(tmp_path / "sheet.xml"))
    assert (back.cfa, back.make, back.model, back.isos) == ("RGGB", camera.make, camera.model, (1600,))
    np.testing.assert_allclose(back.response.quantum_efficiency, camera.response.quantum_efficiency, rtol=1e-9)
    assert back.iso_setting(1600).gain_dn_per_e == pytest.approx(camera.iso_setting(1600).gain_dn_per_e)


def test_the_efficiency_is_that_of_the_colour_that_sees_most(tmp_path):
    camera = load_camera("sony_a7s2")
    nm, curves = camera.response.wavelengths_nm, camera.response.quantum_efficiency
    at_450 = stated_sheet(camera, 1600, 450.0).values
    assert at_450["QE"] == pytest.approx(100 * max(np.interp(450.0, nm, curve) for curve in curves.T))
    best = stated_sheet(camera, 1600).values
    assert best["QE"] == pytest.approx(100 * curves.max()) and best["wavelength"] in nm


@pytest.mark.parametrize(
    ("camera", "iso", "nm", "says"),
    [
        (mono(), 200, 1200.0, "--wavelength 1200 nm: give"),
        (mono(binning=Binning(2)), 200, None, "camera.binning = given: a data sheet is of single photosites"),
        (mono(), 400, None, "400"),
    ],
)
def test_what_has_no_sheet_is_one_message(camera, iso, nm, says):
    with pytest.raises(PhotositeError, match=says):
        stated_sheet(camera, iso, nm)
