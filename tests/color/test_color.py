"""Colour matrix and white point: exact where theory is exact, Delta E 2000 where it cannot be."""

from pathlib import Path

import colour
import numpy as np
import pytest
import yaml
from scipy.optimize import minimize

from simulator import load_camera
from simulator.color.camera_matrices import as_shot_neutral, color_matrix, forward_matrix
from simulator.color.spectra import WAVELENGTHS_NM, color_matching_functions, illuminant, tristimulus
from simulator.errors import PhotositeError

A7S2 = Path(__file__).parents[2] / "configs" / "responses" / "sony_a7s2.yaml"


@pytest.fixture(scope="module")
def a7s2():
    return np.array(yaml.safe_load(A7S2.read_text())["relative"])


FINE_NM = np.arange(380.0, 781.0)  # by 1 nm, so that 1 / lambda is linear in between to 1e-6


def d65_white():
    return white_of("D65")


def test_a_camera_that_is_a_linear_image_of_the_eye_gets_its_exact_matrix():
    # Luther condition: photons to electrons is XYZ times a known matrix, so the fit has no residue.
    truth = np.array([[0.8, 0.3, -0.1], [-0.3, 1.2, 0.2], [0.05, -0.1, 0.6]])
    quantum_efficiency = color_matching_functions(FINE_NM) @ truth.T / FINE_NM[:, None]
    expected = truth / (truth @ d65_white()).max()
    assert color_matrix(FINE_NM, quantum_efficiency) == pytest.approx(expected, abs=2e-5)


def test_white_is_kept_exactly_and_its_largest_channel_is_one(a7s2):
    white = color_matrix(WAVELENGTHS_NM, a7s2) @ d65_white()
    assert white == pytest.approx(as_shot_neutral(illuminant("D65"), WAVELENGTHS_NM, a7s2), abs=1e-12)
    assert white.max() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("chart", ["ColorChecker N Ohta", "BabelColor Average"])  # fitted on the first, not on the second
def test_a7s2_reproduces_the_color_checker_to_delta_e_2000_below_1_5(a7s2, chart):
    matrix = color_matrix(WAVELENGTHS_NM, a7s2)
    shape = colour.SpectralShape(380, 780, 5)
    light = colour.SDS_ILLUMINANTS["D65"].copy().align(shape)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    errors = []
    for patch in colour.SDS_COLOURCHECKERS[chart].values():
        reflectance = patch.copy().align(shape, extrapolator_kwargs={"method": "Constant"})
        truth = colour.sd_to_XYZ(reflectance, observer, light, method="Integration") / 100
        power = reflectance.values * light.values * WAVELENGTHS_NM
        camera = power @ a7s2 / (light.values * WAVELENGTHS_NM @ a7s2).max()
        pair = [colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(d65_white())) for xyz in (np.linalg.solve(matrix, camera), truth)]
        errors.append(colour.delta_E(*pair, method="CIE 2000"))
    assert len(errors) == 24
    assert np.mean(errors) < 1.2
    assert np.max(errors) < 4.0


def test_a7s2_matrix_resembles_the_one_that_converters_ship(a7s2):
    # LibRaw and rawspeed list 0.5838 -0.1430 -0.0246 / -0.3497 1.1477 0.2297 / -0.0748 0.1885 0.5778 for this camera.
    shipped = np.array([[0.5838, -0.1430, -0.0246], [-0.3497, 1.1477, 0.2297], [-0.0748, 0.1885, 0.5778]])
    shipped /= (shipped @ d65_white()).max()
    assert color_matrix(WAVELENGTHS_NM, a7s2) == pytest.approx(shipped, abs=0.13)


def test_scale_of_the_quantum_efficiency_does_not_matter(a7s2):
    assert color_matrix(WAVELENGTHS_NM, 0.1 * a7s2) == pytest.approx(color_matrix(WAVELENGTHS_NM, a7s2), rel=1e-9)


@pytest.mark.parametrize("grid", [np.arange(300.0, 900.5, 1.0), np.arange(400.0, 701.0, 10.0)])
def test_another_grid_of_the_response_gives_the_same_matrix(a7s2, grid):
    curves = np.stack([np.interp(grid, WAVELENGTHS_NM, column, left=0, right=0) for column in a7s2.T], axis=-1)
    assert color_matrix(grid, curves) == pytest.approx(color_matrix(WAVELENGTHS_NM, a7s2), abs=0.02)


def test_channels_that_depend_on_each_other_are_refused(a7s2):
    blend = np.column_stack([a7s2[:, :2], 0.3 * a7s2[:, 0] + 0.7 * a7s2[:, 1]])
    for curves in (np.ones((81, 3)), a7s2[:, [0, 1, 1]], blend):
        with pytest.raises(PhotositeError, match="three different curves"):
            color_matrix(WAVELENGTHS_NM, curves)


def test_one_channel_is_refused():
    with pytest.raises(PhotositeError, match="3 channels"):
        color_matrix(WAVELENGTHS_NM, np.ones((81, 1)))


def test_neutral_counts_photons_not_watts():
    # Each channel sees a narrow line; electrons go as power times wavelength: 1*600, 2*550, 1*450.
    lines = np.array([450.0, 500.0, 550.0, 600.0])
    wavelengths = np.sort(np.concatenate([lines - 0.5, lines, lines + 0.5]))
    power = np.repeat([1.0, 9.0, 2.0, 1.0], 3)
    quantum_efficiency = np.zeros((12, 3))
    quantum_efficiency[[10, 7, 1], [0, 1, 2]] = 1.0
    assert as_shot_neutral(power, wavelengths, quantum_efficiency) == pytest.approx([600 / 1100, 1.0, 450 / 1100], rel=1e-12)


def test_neutral_takes_the_light_on_its_own_grid(a7s2):
    coarse = np.arange(380.0, 781.0, 10.0)
    other = as_shot_neutral(illuminant("A", coarse), WAVELENGTHS_NM, a7s2, illuminant_wavelengths_nm=coarse)
    assert other == pytest.approx(as_shot_neutral(illuminant("A"), WAVELENGTHS_NM, a7s2), abs=5e-3)


def test_tungsten_is_redder_than_daylight(a7s2):
    tungsten, daylight = (as_shot_neutral(illuminant(name), WAVELENGTHS_NM, a7s2) for name in ("A", "D65"))
    assert tungsten[0] / tungsten[2] > 2 * daylight[0] / daylight[2]


def test_a_channel_that_sees_no_light_is_refused():
    with pytest.raises(PhotositeError, match="sees no light"):
        as_shot_neutral(np.array([0.0, 0.0, 1.0]), np.array([500.0, 510.0, 520.0]), np.array([[1.0, 0], [0, 0], [0, 1]]))


LUTHER = np.array([[0.8, 0.3, -0.1], [-0.3, 1.2, 0.2], [0.05, -0.1, 0.6]])  # photons to electrons is XYZ times this


def luther_camera():
    return FINE_NM, color_matching_functions(FINE_NM) @ LUTHER.T / FINE_NM[:, None]


def white_of(light):
    xyz = tristimulus(illuminant(light))
    return xyz / xyz[1]


@pytest.mark.parametrize("light", ["A", "D50", "FL2"])
def test_a_linear_image_of_the_eye_gets_its_exact_matrix_under_any_light(light):
    expected = LUTHER / (LUTHER @ white_of(light)).max()
    assert color_matrix(*luther_camera(), light) == pytest.approx(expected, abs=2e-5)


D50 = np.array([0.9642, 1.0, 0.8249])  # white of the profile connection space, ICC.1:2010
CAMERAS = ("sony_a7s2", "sony_a7_iii", "nikon_d850", "nikon_d3", "canon_5d_mark_iv", "canon_700d", "imx385", "imx686")
LIGHTS = ("A", "D65", "D50", "FL2", "FL11", "LED-B1", "LED-B3")


@pytest.mark.parametrize("light", LIGHTS)
def test_a_linear_image_of_the_eye_gets_its_exact_forward_matrix(light):
    # White-balanced camera back to the camera's own values, from there to XYZ in the light, from there to D50.
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(white_of(light), D50, transform="Bradford")
    to_camera = LUTHER / (LUTHER @ white_of(light))[:, None]
    found = forward_matrix(*luther_camera(), light)
    assert found == pytest.approx(adapt @ np.linalg.inv(to_camera), abs=2e-4)  # its own rounding, and the search's smoothing


@pytest.mark.parametrize("light", ["A", "D65"])
def test_a_forward_matrix_takes_camera_white_to_the_connection_spaces_white(a7s2, light):
    found = forward_matrix(WAVELENGTHS_NM, a7s2, light)
    assert found.sum(axis=1) == pytest.approx(D50, abs=1e-12)
    assert np.array_equal(found, np.round(found, 4))


def chart_under(response, light):
    """White-balanced camera values of the ColorChecker, and its XYZ adapted to D50 by linear Bradford, (24, 3) each.

    By sums over 1 nm, and by colour-science's XYZ of the same spectra.
    """
    shape = colour.SpectralShape(380, 780, 1)
    linear = {"interpolator": colour.LinearInterpolator, "extrapolator_kwargs": {"method": "Constant"}}
    power = colour.SDS_ILLUMINANTS[light].copy().align(shape, **linear)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    curves = [
        np.interp(FINE_NM, response.wavelengths_nm, curve, left=0, right=0) for curve in response.quantum_efficiency.T
    ] * FINE_NM
    camera, xyz = [], []
    white = np.array(colour.sd_to_XYZ(colour.sd_ones(shape), observer, power, method="Integration"))
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(white / white[1], D50, transform="Bradford")
    for patch in colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"].values():
        reflectance = patch.copy().align(shape, **linear)
        camera.append(curves @ (reflectance.values * power.values) / (curves @ power.values))
        xyz.append(adapt @ colour.sd_to_XYZ(reflectance, observer, power, method="Integration") / white[1])
    return np.array(camera), np.array(xyz)


def mean_difference(found_xyz, true_xyz):
    white = colour.XYZ_to_xy(D50)
    return np.mean(colour.delta_E(*(colour.XYZ_to_Lab(each, white) for each in (found_xyz, true_xyz)), method="CIE 2000"))


def least_difference(camera, true_xyz, start):
    """Least mean Delta E 2000 of all matrices that take (1, 1, 1) to D50's white, by Nelder and Mead's search."""

    def matrix_of(first_two):
        return np.column_stack([first_two.reshape(3, 2), D50 - first_two.reshape(3, 2).sum(axis=1)])

    def error_of(first_two):
        return mean_difference(np.maximum(camera @ matrix_of(first_two).T, 0.0), true_xyz)

    first_two = start[:, :2].ravel()
    for _ in range(2):  # begun again, since the simplex may shrink too early
        found = minimize(error_of, first_two, method="Nelder-Mead", options={"maxfev": 1500, "xatol": 1e-5, "fatol": 1e-6})
        first_two = found.x
    return found.fun


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name != "sony_a7s2" else name for name in CAMERAS]
)
def test_a_forward_matrix_has_nearly_the_least_color_difference_of_all_that_keep_white(name, light):
    response = load_camera(name).response
    matrix = forward_matrix(response.wavelengths_nm, response.quantum_efficiency, light)
    camera, true_xyz = chart_under(response, light)
    found, least = mean_difference(camera @ matrix.T, true_xyz), least_difference(camera, true_xyz, matrix)
    print(f"\n{name} {light}: mean Delta E 2000 {found:.3f}, least {least:.3f}")
    assert found < 1.01 * least + 0.002
