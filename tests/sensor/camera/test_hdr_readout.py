"""Companding is piecewise linear and loses half a step at most; readings that make no sense together are refused."""

import re

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.hdr_readout import Companding, HdrReadout
from simulator.sensor.stages.full_well import FullWell

KNEES = ((1024.0, 1024.0), (8192.0, 2048.0))


def test_decoding_passes_through_the_knees_and_encoding_errs_by_half_a_step():
    """Steps of 1, 7 and 27.5 DN: the slopes of the three segments."""
    companding = Companding(12, KNEES)
    table = companding.decoding(64560)
    assert len(table) == 4096 and (table[0], table[1024], table[2048], table[4095]) == (0, 1024, 8192, 64560)
    steps = np.diff(table.astype(int))
    assert set(steps[:1024]) == {1} and set(steps[1024:2048]) == {7} and set(steps[2048:]) <= {27, 28}
    signal = np.arange(64561)
    error = table[companding.encode(signal, 64560)].astype(int) - signal
    assert not error[:1025].any() and np.abs(error[1025:8192]).max() == 3 and np.abs(error[8192:]).max() <= 14
    np.testing.assert_array_equal(table[companding.encode(table.astype(float), 64560)], table)


@pytest.mark.parametrize(
    ("arguments", "white", "message"),
    [
        ((7,), 4095, "camera.hdr_readout.companding.bits = 7: raw files hold 8 to 16 bits"),
        ((12, ((2000.0, 1000.0), (1500.0, 2000.0))), 4095, "camera.hdr_readout.companding.knees"),
        ((12, ((70000.0, 1000.0),)), 64560, "ascend to [64560, 4095]"),
        ((12, ((500.0, 1000.0),)), 64560, "closer together than 1 DN"),
        ((16,), 4095, "closer together than 1 DN"),
    ],
)
def test_companding_that_cannot_be_decoded_is_refused(arguments, white, message):
    with pytest.raises(PhotositeError, match=re.escape(message)):
        Companding(*arguments).decoding(white)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"gains": (1.0,)}, "camera.hdr_readout = 1 readings: give exposures, gains or light of 2 to 4 readings"),
        ({"gains": (1.0, 0.5), "exposures": (1.0, 0.5, 0.25)}, "give one for each of the 3 readings"),
        ({"gains": (0.5, 0.25)}, "camera.hdr_readout.gains"),
        ({"exposures": (1.0, 0.0)}, "camera.hdr_readout.exposures"),
        ({"exposures": (1.0, float("nan"))}, "camera.hdr_readout.exposures"),
        ({"gains": (1.0, 1.0)}, "each reading needs less exposure, gain or light"),
        ({"light": (1.0, 1.0)}, "each reading needs less exposure, gain or light"),
        ({"light": (0.5, 0.1)}, "camera.hdr_readout.light = [0.5, 0.1]: give 1 first"),
        ({"light": (1.0, 0.1), "full_wells": (1.0, 0.0)}, "camera.hdr_readout.full_wells = [1.0, 0.0]"),
        ({"light": (1.0, 0.1), "dark_currents": (1.0, -1.0)}, "camera.hdr_readout.dark_currents = [1.0, -1.0]"),
        ({"gains": (1.0, 0.1), "full_wells": (1.0, 0.5)}, "readings of equal light are of one photodiode"),
        ({"light": (1.0, 0.5, 1.0), "gains": (1.0, 1.0, 0.1)}, "read one charge; give them one after the other"),
        ({"gains": (1.0, 0.5), "switch_at": 1.0}, "camera.hdr_readout.switch_at = 1.0"),
    ],
)
def test_readings_that_do_not_extend_the_range_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=re.escape(message)):
        HdrReadout(**arguments)


def test_equal_exposures_share_a_charge():
    readout = HdrReadout(exposures=(1.0, 1.0, 0.125), gains=(1.0, 0.25, 0.25))
    assert readout.exposure_of == (0, 0, 1) and readout.exposure_shares == (1.0, 0.125)


def test_each_photodiode_and_exposure_has_a_charge_of_its_own():
    """Large diode at two gains, small diode, large diode in a short exposure: three charges of two diodes in two exposures."""
    readout = HdrReadout(exposures=(1.0, 1.0, 1.0, 0.01), gains=(1.0, 0.25, 1.0, 1.0), light=(1.0, 1.0, 0.1, 1.0))
    assert (readout.charge_of, readout.diode_of, readout.exposure_of) == ((0, 0, 1, 2), (0, 0, 1, 0), (0, 0, 0, 1))
    assert [readout.light_share(place) for place in range(4)] == [1.0, 1.0, 0.1, 1.0]


def test_photodiodes_are_relative_to_stages_that_the_camera_has():
    table = {100: IsoSetting(1.0, 2.0)}
    readout = HdrReadout(light=(1.0, 0.1), full_wells=(1.0, 0.5))
    with pytest.raises(PhotositeError, match=re.escape("camera.hdr_readout.full_wells = [1.0, 0.5]: are relative")):
        small_camera(iso_table=table, hdr_readout=readout)
    assert small_camera(iso_table=table, hdr_readout=readout, stages={"full_well": FullWell(1e4)}).hdr_readout == readout
    with pytest.raises(PhotositeError, match="camera.hdr_readout.dark_currents"):
        small_camera(iso_table=table, hdr_readout=HdrReadout(light=(1.0, 0.1), dark_currents=(1.0, 0.5)))


def test_averaged_codes_are_refused_and_isos_are_those_of_all_readings():
    table = {iso: IsoSetting(iso / 100, 2.0) for iso in (100, 200, 400, 800)}
    readout = HdrReadout(gains=(1.0, 0.25))
    assert small_camera(iso_table=table, hdr_readout=readout).isos == (400, 800)
    assert small_camera(iso_table=table, hdr_readout=readout, iso_range="extrapolate").isos == (100, 200, 400, 800)
    with pytest.raises(PhotositeError, match=re.escape("camera.hdr_readout.gains = [1.0, 0.1]: there is no ISO")):
        small_camera(iso_table=table, hdr_readout=HdrReadout(gains=(1.0, 0.1)))
    with pytest.raises(PhotositeError, match="camera.binning.mode = average: combined codes"):
        small_camera(iso_table=table, hdr_readout=readout, binning=Binning(2, "average"))


def test_a_camera_file_gives_readings_and_knees():
    text = "camera.hdr_readout={gains: [1, 0.25], companding: {bits: 12, knees: [[1024, 1024], [8192, 2048]]}}"
    camera = load_camera("sony_a7s2", [text])
    assert camera.hdr_readout == HdrReadout(gains=(1.0, 0.25), companding=Companding(12, KNEES))
    with pytest.raises(PhotositeError, match=r"camera.hdr_readout.gains = .*each reading needs less"):
        load_camera("sony_a7s2", ["camera.hdr_readout.gains=[1, 1]"])
