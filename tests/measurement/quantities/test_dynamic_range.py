"""Dynamic ranges are those of the closed form, and those that Photons to Photos published for the Nikon D300."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.quantities import DynamicRange, MeasuredFrame, PhotonsToPhotos
from simulator.measurement.statistics.signal_to_noise import least_signal_e, photographic_snr
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera_sections import IsoSetting
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise


def dark_frame(**camera) -> MeasuredFrame:
    fields = {"stages": {"photon_shot_noise": PhotonShotNoise()}, "bit_depth": 14}
    body = small_camera(**(fields | camera))
    scene = band_scene(np.ones((48, 64)), interpolation="nearest")
    shot = Shot(scene, ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(1e-9), body)
    return MeasuredFrame.from_raw(simulate(shot), shot)


@pytest.mark.parametrize(("gain", "read_dn"), [(0.25, 1.0), (2.0, 8.0), (8.0, 0.0)])
@pytest.mark.parametrize("snr", [1.0, 5.64])
def test_the_low_end_is_the_root_of_the_signal_to_noise_ratio(gain, read_dn, snr):
    frame = dark_frame(iso_table={100: IsoSetting(gain, read_dn)}, black_level_dn=512.0)
    circle_um = 40.0 / (math.sqrt(math.pi) * snr) * 5.0
    quantity = DynamicRange() if snr == 1.0 else PhotonsToPhotos(circle_um)
    found = quantity.measure(frame).figures
    sigma_e = math.sqrt(read_dn**2 + 1 / 12) / gain
    least = found["least_e"].value
    assert least / math.sqrt(least + sigma_e**2) == pytest.approx(snr, rel=1e-6)
    assert least == pytest.approx(least_signal_e(sigma_e, snr), rel=1e-6)
    assert found["full_scale_e"].value == pytest.approx((16383 - 512) / gain, rel=1e-9)
    assert found["range_ev"].value == pytest.approx(math.log2((16383 - 512) / gain / least), rel=1e-6)


def test_the_nikon_d300_has_the_range_that_photons_to_photos_read_off_its_curve():
    """At ISO 100, 14 bit, its curve passes SNR 1 at 1.63 EV and log2 SNR = 2.49 at 5.00 EV: 12.37 EV and 9.00 EV.

    K is his 1.27 e-/DN ("D300 (and D3) Gain", ISO 200, of which ISO 100 is a setting below the sensor's own); the read noise is
    that which has SNR 1 at 1.63 EV. Both ends were read from a plot to 0.01 EV.
    """
    gain, least_dn = 1.0 / 1.27, 2.0**1.63
    read_dn = math.sqrt(least_dn**2 - gain * least_dn - 1 / 12)
    frame = dark_frame(iso_table={100: IsoSetting(gain, read_dn)}, pixel_pitch_um=5.5)
    assert math.log2(photographic_snr(5.5, 22.0)) == pytest.approx(2.496, abs=0.0005)
    assert DynamicRange().measure(frame).figures["range_ev"].value == pytest.approx(12.37, abs=0.005)
    found = PhotonsToPhotos(22.0).measure(frame).figures
    assert found["range_ev"].value == pytest.approx(9.00, abs=0.015)
    assert math.log2(found["snr"].value) == pytest.approx(2.496, abs=0.0005)


def test_without_a_circle_the_sensors_diagonal_gives_that_of_the_d300():
    frame = dark_frame(pixel_pitch_um=5.5, width_px=4288, height_px=2868, window=None)
    assert PhotonsToPhotos().measure(frame).figures["snr"].value == pytest.approx(photographic_snr(5.5, 22.0), rel=2e-3)


def test_a_range_without_a_low_end_is_not_told():
    frame = dark_frame(iso_table={100: IsoSetting(8000.0, 8.0)}, black_level_dn=512.0)  # two electrons are white
    found = PhotonsToPhotos(5.0).measure(frame).figures
    assert math.isnan(found["range_ev"].value) and found["full_scale_e"].value == pytest.approx(1.98, abs=0.01)


def test_a_bare_file_and_a_circle_of_0_are_refused():
    file = dataclasses.replace(dark_frame(), raw=None, shot=None, name="a.dng")
    with pytest.raises(PhotositeError, match=r"a\.dng: dynamic_range: needs the truth and the shot of a simulated frame"):
        DynamicRange().measure(file)
    with pytest.raises(PhotositeError, match="circle_of_confusion = 0 um: give a diameter above 0"):
        PhotonsToPhotos(0.0).measure(dark_frame())
