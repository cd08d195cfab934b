"""The same light gives the same electrons as a chart, a cube of any step and a picture."""

import numpy as np
import pytest
from scipy.integrate import quad

from simulator import load_camera
from simulator.color.spectra import LIGHT_SPEED_M_S, PLANCK_J_S, WAVELENGTHS_NM, illuminant, luminance_cd_m2
from simulator.scene.arrays import scene_from_rgb, scene_from_spectra
from simulator.scene.charts import ChartScene
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.sensor.camera.camera import SpectralResponse

CAMERA = load_camera("sony_a7s2").response  # 380 to 780 nm by 5 nm
BAND_NM = np.arange(400.0, 701.0, 10.0)  # a camera that sees 400 to 700 nm alone
NARROW = SpectralResponse(
    BAND_NM, np.stack([np.interp(BAND_NM, CAMERA.wavelengths_nm, curve) for curve in CAMERA.quantum_efficiency.T], axis=-1)
)
STEPS_NM = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


def electrons(scene, response):
    """Electron radiance of the upper left pixel in each colour."""
    weights = electron_radiance_weights(scene, response.wavelengths_nm, response.quantum_efficiency)
    return scene.planes[0, 0].astype(np.float64) @ weights


def true_electrons(spectrum, response, low_nm, high_nm):
    """The integral of L(lambda) lambda / (h c) QE(lambda) by adaptive quadrature in double precision, [e- s^-1 um^-2 sr^-1]."""
    edges = np.union1d(response.wavelengths_nm, WAVELENGTHS_NM)
    edges = edges[(edges >= low_nm) & (edges <= high_nm)]
    found = []
    for curve in response.quantum_efficiency.T:

        def integrand(nm, curve=curve):
            return spectrum(nm) * nm * np.interp(nm, response.wavelengths_nm, curve)

        found.append(sum(quad(integrand, a, b, epsabs=0.0, epsrel=1e-13)[0] for a, b in zip(edges, edges[1:], strict=False)))
    return np.array(found) * 1e-21 / (PLANCK_J_S * LIGHT_SPEED_M_S)


def light_of(name):
    """Spectral radiance of a light of 100 cd/m^2, linear between its entries."""
    power = illuminant(name)
    table = power * (100.0 / luminance_cd_m2(power))
    return lambda nm: np.interp(nm, WAVELENGTHS_NM, table)


@pytest.mark.parametrize("name", ["E", "D65", "A", "FL2"])
@pytest.mark.parametrize(("response", "low_nm", "high_nm"), [(CAMERA, 380.0, 780.0), (NARROW, 400.0, 700.0)])
def test_charts_cubes_and_pictures_of_the_same_light_count_the_same_electrons(name, response, low_nm, high_nm):
    light = light_of(name)
    truth = true_electrons(light, response, low_nm, high_nm)
    chart = ChartScene("flat_field", 100.0, name).load()
    picture = scene_from_rgb(np.ones((2, 2, 3), np.float32), luminance_cd_m2=100.0, illuminant=name)
    for scene in (chart, picture):
        assert electrons(scene, response) == pytest.approx(truth, rel=1e-12)
    for step_nm in STEPS_NM:
        own_nm = np.arange(low_nm, high_nm + 0.1, step_nm)
        white = np.ones((2, 2, own_nm.size), np.float32)
        cube = scene_from_spectra(white, own_nm, quantity="reflectance", luminance_cd_m2=100.0, illuminant=name)
        assert electrons(cube, response) == pytest.approx(truth, rel=1e-12), step_nm
        if step_nm in (1.0, 5.0):  # steps that hold the light's own 5 nm
            cube = scene_from_spectra(light(own_nm) * np.ones((2, 2, 1)), own_nm)
            assert electrons(cube, response) == pytest.approx(truth, rel=1e-6), step_nm  # single precision of the cube


@pytest.mark.parametrize(("slope", "least"), [(0.0, 1.0), (0.004, 0.2), (-0.002, 0.9)])
@pytest.mark.parametrize("response", [CAMERA, NARROW], ids=["380 to 780 nm", "400 to 700 nm"])
def test_flat_and_sloped_radiance_counts_the_same_in_steps_of_any_size(slope, least, response):
    def spectrum(nm):
        return least + slope * (nm - 400.0)

    truth = true_electrons(spectrum, response, 400.0, 700.0)
    for step_nm in STEPS_NM:
        own_nm = np.arange(400.0, 700.1, step_nm)
        cube = scene_from_spectra(spectrum(own_nm) * np.ones((2, 2, 1)), own_nm)
        assert electrons(cube, response) == pytest.approx(truth, rel=1e-6), step_nm
    uneven_nm = np.array([400.0, 413.0, 502.5, 640.0, 700.0])
    cube = scene_from_spectra(spectrum(uneven_nm) * np.ones((2, 2, 1)), uneven_nm)
    assert electrons(cube, response) == pytest.approx(truth, rel=1e-6)


def test_a_sloped_reflectance_counts_the_same_as_a_chart_and_in_steps_of_any_size():
    light, response = light_of("D65"), NARROW
    chart = ChartScene("flat_field", 100.0, "D65").load()
    slope = 0.3 + 0.002 * (WAVELENGTHS_NM - 400.0)
    truth = electrons(scene_from_spectra((slope * light(WAVELENGTHS_NM)) * np.ones((2, 2, 1)), WAVELENGTHS_NM), response)
    assert (electrons(chart, response) > truth).all()
    for step_nm in STEPS_NM[2:]:
        own_nm = np.arange(400.0, 700.1, step_nm)
        pixels = (0.3 + 0.002 * (own_nm - 400.0)) * np.ones((2, 2, 1))
        cube = scene_from_spectra(pixels, own_nm, quantity="reflectance", luminance_cd_m2=100.0, illuminant="D65")
        assert electrons(cube, response) == pytest.approx(truth, rel=1e-6), step_nm
