"""Spectra against the CIE's published numbers, the SI's constants and sums done by hand."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.integrate import quad

from simulator.color.spectra import (
    ILLUMINANTS,
    WAVELENGTHS_NM,
    check_illuminant,
    color_matching_functions,
    illuminant,
    integral_weights,
    luminance_cd_m2,
    luminous_efficiency,
    photons_per_joule,
    reflectance_basis,
)
from simulator.errors import PhotositeError
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene

REPOSITORY = Path(__file__).parents[2]
A7S2_RESPONSE = REPOSITORY / "configs" / "responses" / "sony_a7s2.yaml"
A7S2_MEASURED = REPOSITORY.parent / "shared" / "data" / "spectral_sensitivity" / "Sony_ILCE-7SM2_380_780_5.json"


def equal_energy_scene(wavelengths_nm, luminance=1.0):
    """One plane of equal-energy light."""
    spectrum = np.ones((1, len(wavelengths_nm)))
    spectrum *= luminance / luminance_cd_m2(spectrum[0], wavelengths_nm)
    return Scene(np.ones((1, 1, 1), np.float32), spectrum, wavelengths_nm, np.ones(len(wavelengths_nm)))


def test_grid_is_380_to_780_nm_by_5():
    assert WAVELENGTHS_NM.shape == (81,) and WAVELENGTHS_NM[0] == 380 and WAVELENGTHS_NM[-1] == 780
    assert set(np.diff(WAVELENGTHS_NM)) == {5.0}


def test_luminous_efficiency_has_the_values_of_the_cie_table():
    # CIE 018:2019, Table 1
    assert luminous_efficiency(np.array([510.0, 555.0, 610.0])) == pytest.approx([0.503, 1.0, 0.503], abs=1e-9)
    assert luminous_efficiency(np.arange(400.0, 701.0, 10.0)).sum() * 10 == pytest.approx(106.815, abs=1e-3)
    assert luminous_efficiency(np.array([350.0, 900.0])).tolist() == [0, 0]


def test_one_lux_at_555_nm_is_4091_photons_per_um2_and_second():
    # lambda / (h c K) by hand: 555e-9 / (6.62607015e-34 * 299792458) / 683 = 4.0907e15 per m^2
    assert photons_per_joule(np.array([555.0]))[0] / 683e12 == pytest.approx(4090.68, rel=1e-6)


def test_one_candela_per_m2_of_equal_energy_light_is_11388_photons_per_um2_second_and_steradian():
    # 400 to 700 nm: the integral of lambda / (h c), over 683 times that of V, tabulated by 1 nm; QE 1 counts all photons.
    wavelengths = np.arange(400.0, 701.0, 10.0)
    weights = electron_radiance_weights(equal_energy_scene(wavelengths), np.array([300.0, 900.0]), np.ones((2, 1)))
    photons = 165000e-9 / (6.62607015e-34 * 299792458)
    visible = 683.0 * np.trapezoid(luminous_efficiency(np.arange(400.0, 701.0)), dx=1.0)
    assert weights.shape == (1, 1)
    assert weights[0, 0] == pytest.approx(1e-12 * photons / visible, rel=1e-12)
    assert weights[0, 0] == pytest.approx(11387.8, abs=0.1)


def test_electrons_of_a_2_8_um_pixel_at_f4_match_the_hand_calculation():
    # 100 cd/m^2, 10 ms, E/L = pi / (1 + 4 * 16) sr: 11387.8 * 100 * pi / 65 * 2.8^2 * 0.01 = 4315.1 electrons at QE 1
    wavelengths = np.arange(400.0, 701.0, 10.0)
    scene = equal_energy_scene(wavelengths, luminance=100.0)
    weight = electron_radiance_weights(scene, np.array([300.0, 900.0]), np.ones((2, 1)))[0, 0]
    assert weight * np.pi / 65 * 2.8**2 * 0.010 == pytest.approx(4315.1, abs=0.1)


def test_response_is_linear_between_its_entries_and_zero_outside_them():
    # From 0.2 at 490 nm to 0.6 at 510 nm: the integral of (0.4 + 0.02 u)(500 + u) over u from -10 to 10 is 4000 + 40/3 nm^2.
    wavelengths = np.array([400.0, 500.0, 600.0])
    scene = Scene(np.ones((1, 1, 1), np.float32), np.ones((1, 3)), wavelengths, np.ones(3))
    weight = electron_radiance_weights(scene, np.array([490.0, 510.0]), np.array([[0.2], [0.6]]))[0, 0]
    by_hand = (4000.0 + 40.0 / 3.0) * 1e-9 / (6.62607015e-34 * 299792458) * 1e-12
    assert weight == pytest.approx(by_hand, rel=1e-12)


def adaptive_integral(grid, samples, own, curve, low, high):
    """Integral of s(lambda) c(lambda) lambda by adaptive quadrature in double precision, told where the functions bend."""
    points = np.union1d(grid, own)
    points = points[(points > low) & (points < high)]
    edges = [low, *points, high]
    return sum(
        quad(lambda nm: np.interp(nm, grid, samples) * np.interp(nm, own, curve) * nm, one, other, epsabs=0.0, epsrel=1e-13)[0]
        for one, other in zip(edges, edges[1:], strict=False)
    )


@pytest.mark.parametrize("grid", [np.arange(380.0, 781.0, 5.0), np.arange(403.0, 700.0, 11.0), np.array([390.0, 500.5, 777.0])])
@pytest.mark.parametrize("own", [np.arange(400.0, 701.0, 10.0), np.arange(360.0, 831.0, 7.0)])
def test_integrals_are_those_of_the_piecewise_linear_functions(grid, own):
    rng = np.random.default_rng(5)
    samples, curve = rng.random(grid.size), rng.random(own.size)
    low, high = max(grid[0], own[0]), min(grid[-1], own[-1])
    found = samples @ integral_weights(grid, own, curve[:, None], of_photons=True)
    truth = adaptive_integral(grid, samples, own, curve, low, high) * photons_per_joule(np.array(1.0))
    assert found == pytest.approx(truth, rel=1e-12)


def test_bands_that_do_not_overlap_have_no_integral():
    assert not integral_weights(np.array([400.0, 500.0]), np.array([600.0, 700.0]), np.ones((2, 3))).any()


def test_bands_and_channels_keep_their_places():
    wavelengths = np.array([500.0, 510.0])
    scene = Scene(np.ones((1, 1, 2), np.float32), np.eye(2), wavelengths, np.ones(2))
    weights = electron_radiance_weights(scene, wavelengths, np.array([[1.0, 0.0, 0.5], [0.0, 2.0, 0.0]]))
    assert weights.shape == (2, 3)
    # Channel 0 falls from 1 at 500 nm to 0 at 510 nm as band 0 does: integral of (1 - u)^2 (500 + 10 u), u from 0 to 1.
    square, cross = 10 * (500 / 3 + 10 / 12), 10 * (500 / 6 + 10 / 12)
    per_nm2 = 1e-21 / (6.62607015e-34 * 299792458)
    assert weights[:, 0] == pytest.approx(per_nm2 * np.array([square, cross]), rel=1e-12)
    assert weights[:, 2] == pytest.approx(0.5 * weights[:, 0], rel=1e-12)
    assert weights[:, 1] == pytest.approx(2 * per_nm2 * np.array([cross, 10 * (500 / 3 + 10 / 4)]), rel=1e-12)


@pytest.mark.parametrize("wavelengths", [[500.0], [500.0, 500.0, 510.0], [510.0, 500.0]])
def test_wavelengths_that_do_not_ascend_are_refused(wavelengths):
    with pytest.raises(PhotositeError, match="two or more ascending"):
        integral_weights(np.array(wavelengths), np.array([400.0, 700.0]), np.ones((2, 1)))


# CIE 15:2018, Table T.3 (2 degree observer); E is 1/3, 1/3 by definition.
CHROMATICITIES = {
    "A": (0.44758, 0.40745),
    "D50": (0.34567, 0.35851),
    "D55": (0.33243, 0.34744),
    "D65": (0.31272, 0.32903),
    "E": (1 / 3, 1 / 3),
}


@pytest.mark.parametrize("name", CHROMATICITIES)
def test_illuminants_have_their_published_chromaticity(name):
    xyz = illuminant(name) @ color_matching_functions()
    assert xyz[:2] / xyz.sum() == pytest.approx(CHROMATICITIES[name], abs=3e-5)
    assert np.interp(560, WAVELENGTHS_NM, illuminant(name)) == pytest.approx(1.0)


def test_illuminant_a_is_the_blackbody_that_the_cie_defines():
    # CIE 15: T = 2848 K with c2 = 0.01435 m K, the same curve as T = 2855.5 K with the SI's c2 = 0.0143878 m K
    ratio = illuminant(f"blackbody {2848 * 1.4387769 / 1.435:.3f} K") / illuminant("A")
    assert ratio == pytest.approx(np.ones(81), abs=2e-5)


def test_blackbody_peaks_where_wien_says():
    fine = np.arange(380.0, 781.0)
    assert fine[illuminant("5000 K", fine).argmax()] == round(2.897771955e6 / 5000)
    assert illuminant("5000 K", fine) == pytest.approx(illuminant("blackbody 5000 K", fine))


@pytest.mark.parametrize(
    ("name", "says"),
    [("D56", "D55"), ("d65", "D65"), ("fluorescent", "Known: A"), ("3200", "Known"), ("50 K", "between 500 K")],
)
def test_unknown_illuminant_names_the_nearest(name, says):
    with pytest.raises(PhotositeError, match=says):
        check_illuminant(name, "scene.illuminant")


def test_every_listed_illuminant_has_data_over_the_whole_grid():
    for name in ILLUMINANTS:
        assert illuminant(name).shape == (81,) and illuminant(name).min() >= 0 and illuminant(name).max() > 0.5, name


def test_reflectance_basis_is_physical_and_adds_up_to_white():
    basis = reflectance_basis("mallett2019")
    assert basis.shape == (3, 81) and basis.min() >= 0
    assert basis.sum(axis=0) == pytest.approx(np.ones(81), abs=1e-12)


def test_reflectance_basis_under_d65_gives_the_srgb_matrix():
    # IEC 61966-2-1: XYZ of the linear primaries, to four digits
    srgb = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    lit = reflectance_basis("mallett2019") * illuminant("D65")
    xyz = lit @ color_matching_functions() / (illuminant("D65") @ luminous_efficiency())
    assert xyz.T == pytest.approx(srgb, abs=1e-3)


def test_unknown_upsampling_is_refused():
    with pytest.raises(PhotositeError, match="mallett2019"):
        reflectance_basis("smits1999")


def test_a7s2_peak_quantum_efficiency_fills_the_adc_at_the_saturation_exposure():
    response = yaml.safe_load(A7S2_RESPONSE.read_text())
    green = response["peak_quantum_efficiency"] * np.array(response["relative"])[:, 1]
    exposure_lx_s = 78 / 100  # ISO 12232, ISO 100
    full_scale_e = (16383 - 512) / 0.09563
    light = illuminant("D55")
    joule_per_m2_nm = light * exposure_lx_s / luminance_cd_m2(light)
    electrons = (joule_per_m2_nm * photons_per_joule(WAVELENGTHS_NM) * green).sum() * 5 * (8.40e-6) ** 2
    assert electrons == pytest.approx(full_scale_e, rel=1e-3)
    assert 0.3 < green.max() < 0.8


def test_a7s2_file_has_81_rows_and_its_largest_entry_is_one():
    response = yaml.safe_load(A7S2_RESPONSE.read_text())
    relative = np.array(response["relative"])
    assert relative.shape == (81, 3) and relative.max() == 1.0 and relative.min() >= 0
    assert response["wavelengths"] == {"start": "380 nm", "step": "5 nm"}
    assert WAVELENGTHS_NM[relative.argmax(axis=0)].tolist() == [590, 535, 470]
    assert "rawtoaces" in response["source"]["wavelengths, relative"] and response["license"] == "Apache-2.0"


@pytest.mark.skipif(not A7S2_MEASURED.exists(), reason=f"measured curves not here: {A7S2_MEASURED.name}")
def test_a7s2_file_holds_the_measured_curves():
    measured = json.loads(A7S2_MEASURED.read_text())["spectral_data"]["data"]["main"]
    relative = np.array(yaml.safe_load(A7S2_RESPONSE.read_text())["relative"])
    assert relative == pytest.approx(np.array([measured[f"{nm:.0f}"] for nm in WAVELENGTHS_NM]), abs=5.1e-5)


def test_importing_scenes_loads_no_heavy_library():
    code = (
        "import simulator.scene.image, simulator.scene.spectral_cube, simulator.scene.charts, "
        "simulator.color.camera_matrices, sys;"
        "sys.exit(', '.join({'colour', 'OpenImageIO', 'scipy', 'matplotlib'} & set(sys.modules)) or 0)"
    )
    result = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
