"""Colour matrix and white point: exact where theory is exact, Delta E 2000 where it cannot be."""

from pathlib import Path

import colour
import numpy as np
import pytest
import yaml

from simulator.color.camera_matrices import as_shot_neutral, color_matrix, forward_matrix
from simulator.color.spectra import WAVELENGTHS_NM, color_matching_functions, illuminant
from simulator.errors import PhotositeError

A7S2 = Path(__file__).parents[2] / "configs" / "responses" / "sony_a7s2.yaml"


@pytest.fixture(scope="module")
def a7s2():
    return np.array(yaml.safe_load(A7S2.read_text())["relative"])


def d65_white():
    observer = color_matching_functions()
    light = illuminant("D65")
    return light @ observer / (light @ observer[:, 1])


def test_a_camera_that_is_a_linear_image_of_the_eye_gets_its_exact_matrix():
    # Luther condition: photons to electrons is XYZ times a known matrix, so the fit has no residue.
    truth = np.array([[0.8, 0.3, -0.1], [-0.3, 1.2, 0.2], [0.05, -0.1, 0.6]])
    quantum_efficiency = color_matching_functions() @ truth.T / WAVELENGTHS_NM[:, None]
    expected = truth / (truth @ d65_white()).max()
    assert color_matrix(WAVELENGTHS_NM, quantum_efficiency) == pytest.approx(expected, abs=1e-9)


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
    # Each channel sees one line; electrons go as power times wavelength: 1*600, 2*550, 1*450.
    wavelengths = np.array([450.0, 500.0, 550.0, 600.0])
    quantum_efficiency = np.array([[0, 0, 1], [0, 0, 0], [0, 1, 0], [1, 0, 0]], float)
    neutral = as_shot_neutral(np.array([1.0, 9.0, 2.0, 1.0]), wavelengths, quantum_efficiency)
    assert neutral == pytest.approx([600 / 1100, 1.0, 450 / 1100], rel=1e-12)


def test_neutral_takes_the_light_on_its_own_grid(a7s2):
    coarse = np.arange(380.0, 781.0, 10.0)
    other = as_shot_neutral(illuminant("A", coarse), WAVELENGTHS_NM, a7s2, illuminant_wavelengths_nm=coarse)
    assert other == pytest.approx(as_shot_neutral(illuminant("A"), WAVELENGTHS_NM, a7s2), abs=5e-3)


def test_tungsten_is_redder_than_daylight(a7s2):
    tungsten, daylight = (as_shot_neutral(illuminant(name), WAVELENGTHS_NM, a7s2) for name in ("A", "D65"))
    assert tungsten[0] / tungsten[2] > 2 * daylight[0] / daylight[2]


def test_a_channel_that_sees_no_light_is_refused():
    with pytest.raises(PhotositeError, match="sees no light"):
        as_shot_neutral(np.array([0.0, 1.0]), np.array([500.0, 510.0]), np.eye(2))


LUTHER = np.array([[0.8, 0.3, -0.1], [-0.3, 1.2, 0.2], [0.05, -0.1, 0.6]])  # photons to electrons is XYZ times this


def luther_camera():
    return color_matching_functions() @ LUTHER.T / WAVELENGTHS_NM[:, None]


def white_of(light):
    power, observer = illuminant(light), color_matching_functions()
    return power @ observer / (power @ observer[:, 1])


@pytest.mark.parametrize("light", ["A", "D50", "FL2"])
def test_a_linear_image_of_the_eye_gets_its_exact_matrix_under_any_light(light):
    expected = LUTHER / (LUTHER @ white_of(light)).max()
    assert color_matrix(WAVELENGTHS_NM, luther_camera(), light) == pytest.approx(expected, abs=1e-9)


def test_a_linear_image_of_the_eye_gets_its_exact_forward_matrix_under_d50():
    # White-balanced camera back to the camera's own values, from there to XYZ; the table's D50 differs from the ICC's by 2e-4.
    to_camera = LUTHER / (LUTHER @ white_of("D50"))[:, None]
    expected = np.array([0.9642, 1.0, 0.8249])[:, None] * np.linalg.inv(to_camera) / white_of("D50")[:, None]
    assert forward_matrix(WAVELENGTHS_NM, luther_camera(), "D50") == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("light", ["A", "D65"])
def test_a_forward_matrix_takes_camera_white_to_the_connection_spaces_white(a7s2, light):
    assert forward_matrix(WAVELENGTHS_NM, a7s2, light).sum(axis=1) == pytest.approx([0.9642, 1.0, 0.8249], abs=1e-12)


def chart_under(a7s2, light):
    """White-balanced camera values of the ColorChecker under a light, and its XYZ under D50, (24, 3) each."""
    shape = colour.SpectralShape(380, 780, 5)
    lights = {name: colour.SDS_ILLUMINANTS[name].copy().align(shape) for name in (light, "D50")}
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    camera, xyz = [], []
    for patch in colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"].values():
        reflectance = patch.copy().align(shape, extrapolator_kwargs={"method": "Constant"})
        photons = lights[light].values * WAVELENGTHS_NM
        camera.append((reflectance.values * photons) @ a7s2 / (photons @ a7s2))
        xyz.append(colour.sd_to_XYZ(reflectance, observer, lights["D50"], method="Integration") / 100)
    return np.array(camera), np.array(xyz)


@pytest.mark.parametrize("light", ["A", "D65"])
def test_no_other_matrix_that_keeps_white_is_nearer_to_the_chart_under_d50(a7s2, light):
    camera, xyz = chart_under(a7s2, light)
    target = xyz / white_of("D50")
    balanced = forward_matrix(WAVELENGTHS_NM, a7s2, light) / np.array([0.9642, 1.0, 0.8249])[:, None]
    residue = camera @ balanced.T - target
    # At the least sum of squares under "rows add up to 1" the gradient is the same along each row.
    gradient = residue.T @ camera
    assert np.ptp(gradient, axis=1) == pytest.approx(0, abs=1e-6)
    assert np.abs(gradient).max() > 1e-3


@pytest.mark.parametrize("light", ["A", "D65"])
def test_forward_matrices_come_nearer_to_the_chart_under_d50_than_linear_bradford(a7s2, light):
    # DNG 1.4: without a forward matrix, converters invert the colour matrix and adapt its XYZ to D50 by linear Bradford.
    camera, xyz = chart_under(a7s2, light)
    neutral = as_shot_neutral(illuminant(light), WAVELENGTHS_NM, a7s2)
    adaptation = colour.adaptation.matrix_chromatic_adaptation_VonKries(white_of(light), white_of("D50"), transform="Bradford")
    adapted = camera * neutral @ np.linalg.inv(color_matrix(WAVELENGTHS_NM, a7s2, light)).T @ adaptation.T
    found = camera @ forward_matrix(WAVELENGTHS_NM, a7s2, light).T
    white = colour.XYZ_to_xy(white_of("D50"))
    true_lab, *labs = (colour.XYZ_to_Lab(each, white) for each in (xyz, found, adapted))
    forward, bradford = (np.mean(colour.delta_E(lab, true_lab, method="CIE 2000")) for lab in labs)
    assert forward < bradford
