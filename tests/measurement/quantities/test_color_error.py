"""Colour error of a ColorChecker: none behind a camera that sees as the CIE observer, and that of colour-science else."""

import dataclasses

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.color.camera_matrices import chart_reflectances
from simulator.color.colour_science import colour_science
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, tristimulus
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.quantities import ColorError, MeasuredFrame
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.raw_image import Raw
from simulator.scene.charts import ChartScene
from simulator.sensor.camera.camera_sections import SpectralResponse


@pytest.fixture(scope="module")
def chart() -> tuple[Raw, Shot]:
    """The chart without noise, behind colours that see as the CIE 1931 observer does."""
    observer = colour_science().MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    nm = np.arange(380.0, 781.0, 5.0)
    curves = np.stack([np.interp(nm, observer.wavelengths, observer.values[:, band]) for band in range(3)], axis=1)
    per_photon = curves / nm[:, None]  # electrons count photons, the observer energy
    response = SpectralResponse(nm, 0.9 * per_photon / per_photon.max())
    camera = small_camera(288, 192, "RGGB", response=response, black_level_dn=256.0)
    shot = Shot(ChartScene("color_checker", 100.0), ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(0.01), camera)
    brightest = float(simulate(shot).mean_electrons.max())
    shot = dataclasses.replace(shot, exposure=Exposure(0.01 * 40000.0 / brightest))
    return simulate(shot), shot


def test_a_camera_that_sees_as_the_observer_has_no_error(chart):
    """Rounding to 16 bits and a colour matrix of ten-thousandths are left."""
    found = ColorError().measure(MeasuredFrame.from_raw(*chart))
    assert found.figures["mean"].value < 0.1 and found.figures["largest"].value < 0.3
    assert found.curves["patches"].x.tolist() == list(range(1, 25))
    assert found.figures["mean"].value == pytest.approx(found.curves["patches"].y.mean())


def test_a_wrong_white_balance_has_the_error_that_colour_science_tells(chart):
    """The observer's channels are X, Y and Z, so a balance wrong by 0.8 in Z develops Z 0.8 times too dark."""
    raw, shot = chart
    neutral = np.array(raw.as_shot_neutral) * (1.0, 1.0, 1.0 / 0.8)
    wrong = dataclasses.replace(raw, as_shot_neutral=tuple(neutral / neutral.max()))
    found = ColorError().measure(MeasuredFrame.from_raw(wrong, shot)).curves["patches"].y
    colour = colour_science()
    white = tristimulus(illuminant("D65"))
    true = tristimulus(chart_reflectances(WAVELENGTHS_NM) * illuminant("D65")) / white[1]
    d50 = np.array([0.9642, 1.0, 0.8249])
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(white / white[1], d50, "Bradford")
    measured, expected = true * (1.0, 1.0, 0.8) @ adapt.T, true @ adapt.T
    measured *= (measured[:, 1] @ expected[:, 1]) / (measured[:, 1] @ measured[:, 1])
    lab = [colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(d50)) for xyz in (measured, expected)]
    assert found == pytest.approx(colour.delta_E(*lab, method="CIE 2000"), abs=0.15)
    assert found[18:].min() > 4.0  # the greys are yellow


def test_an_area_is_that_of_the_chart(chart):
    """The chart within a dark border is measured as the chart alone."""
    raw, shot = chart
    dn = np.full((224, 320), 256, np.uint16)
    dn[16:208, 16:304] = raw.dn
    bordered = dataclasses.replace(raw, dn=dn, mean_electrons=np.zeros(dn.shape), noise_free_dn=np.zeros(dn.shape))
    found = ColorError((16, 16, 192, 288)).measure(MeasuredFrame.from_raw(bordered, shot)).figures["mean"].value
    assert found == pytest.approx(ColorError().measure(MeasuredFrame.from_raw(raw, shot)).figures["mean"].value, abs=0.01)
    with pytest.raises(PhotositeError, match="area = .*: holds 24 patches of 3 x 3 photosites inside"):
        ColorError((0, 0, 16, 24)).measure(MeasuredFrame.from_raw(bordered, shot))


def test_a_frame_without_colour_is_refused():
    frame = MeasuredFrame(np.zeros((48, 64), np.uint16), "MONO", np.zeros((2, 2)), 4095, name="a.dng")
    with pytest.raises(PhotositeError, match=r"a\.dng: color_error = MONO: a sensor without filter measures no colour"):
        ColorError().measure(frame)
