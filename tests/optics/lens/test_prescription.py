"""Lens prescriptions against Optiland's own spots, MTF, distortion and chief rays; and what is refused."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from simulator.config import build_shot_from_data, load_shot
from simulator.errors import PhotositeError
from simulator.optics.lens.prescription import trace_prescription
from simulator.optics.psf.fraunhofer import compute_psf

LENSES = Path(__file__).parents[3] / "configs" / "lenses"
GAUSS, SINGLET = LENSES / "double_gauss.zmx", LENSES / "singlet.seq"
HALF_MM = 21.6
INSTALLED = importlib.util.find_spec("optiland") is not None
needs_optiland = pytest.mark.skipif(not INSTALLED, reason="Optiland is not installed; `make test-all` installs it")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")


def read_library(path, angles_deg, pupil_mm=None):
    """The lens in Optiland with these fields, without the apertures that stop rays."""
    from optiland import fileio

    load = {".zmx": fileio.load_zemax_file, ".seq": fileio.load_codev_file}[path.suffix]
    lens = load(str(path))
    for surface in lens.surfaces:
        surface.aperture = None
    lens.set_aperture("EPD", float(np.squeeze(lens.paraxial.EPD())) if pupil_mm is None else pupil_mm)
    lens.fields.fields.clear()
    lens.fields.set_type("angle")
    for angle in angles_deg:
        lens.fields.add(y=angle)
    return lens


def chief_mm(lens, share, wavelength_um):
    """Height of the chief ray of this share of the largest field."""
    rays = lens.trace_generic(np.zeros(1), np.array([share]), np.zeros(1), np.zeros(1), wavelength_um)
    return abs(float(np.squeeze(rays.y)))


def spot_rms_um(traced, height_mm, wavelength_nm, f_number=None):
    """Root mean square radius of the rays of our wavefront, about their mean, by central differences."""
    f_number = f_number or traced.f_number
    radius, angle = np.sqrt((np.arange(60) + 0.5) / 60)[:, None], 2 * math.pi * np.arange(90) / 90
    u, v, step = (radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel(), 1e-5

    def wavefront_um(a, b):
        return traced.aberrations.wavefront_error_um(a, b, f_number, wavelength_nm, (height_mm / HALF_MM, 0.0))

    dx = (wavefront_um(u + step, v) - wavefront_um(u - step, v)) / (2 * step)
    dy = (wavefront_um(u, v + step) - wavefront_um(u, v - step)) / (2 * step)
    return 2 * f_number * math.sqrt(dx.var() + dy.var())


# dgauss.50mm.dat of pbrt: radius and distance to the next surface [mm], index behind it (d line).
PBRT_DOUBLE_GAUSS = """
29.475 3.76 1.67    84.83 0.12 1       19.275 4.025 1.67   40.77 3.275 1.699   12.75 5.705 1   0 4.5 1
-14.495 1.18 1.603  40.77 6.065 1.658  -20.385 0.19 1      437.065 3.22 1.717  -39.73 0 1
"""


def test_the_double_gauss_has_the_numbers_of_other_copies():
    """All surfaces, and by rays near the axis the focal length and the back focus that its maker states."""
    found = []
    for part in GAUSS.read_text().split("SURF ")[2:-1]:
        lines = {words[0]: words[1:] for words in map(str.split, part.splitlines()[1:])}
        curvature, index = float(lines["CURV"][0]), float(lines["GLAS"][3]) if "GLAS" in lines else 1.0
        found.append((1.0 / curvature if curvature else 0.0, float(lines["DISZ"][0]), index))
    wanted = np.array(PBRT_DOUBLE_GAUSS.split(), float).reshape(-1, 3) * [2.0, 2.0, 1.0]
    np.testing.assert_allclose(np.array(found)[:, [0, 2]], wanted[:, [0, 2]], rtol=1e-9)
    np.testing.assert_allclose(np.array(found)[:-1, 1], wanted[:-1, 1], rtol=1e-9)
    height, angle, before = 1.0, 0.0, 1.0
    for number, (radius, distance, index) in enumerate(found):
        angle = (before * angle - (height * (index - before) / radius if radius else 0.0)) / index
        height += angle * distance if number + 1 < len(found) else 0.0
        before = index
    assert -1.0 / angle == pytest.approx(100.0, rel=0.01)
    assert -height / angle == pytest.approx(found[-1][1], rel=0.01)


@pytest.mark.slow
@needs_optiland
def test_first_order_numbers_are_those_of_the_maker():
    singlet = trace_prescription(SINGLET, math.inf, HALF_MM)
    assert singlet.focal_length_mm == pytest.approx(100.0, abs=0.01) and singlet.f_number == pytest.approx(5.6, abs=1e-3)
    gauss = trace_prescription(GAUSS, math.inf, HALF_MM)
    assert gauss.focal_length_mm == pytest.approx(100.0, rel=0.01) and gauss.f_number == pytest.approx(2.0, rel=0.01)
    assert gauss.fit_um < 3.0 and singlet.fit_um < 3.0


@pytest.mark.slow
@needs_optiland
@pytest.mark.parametrize("path", [GAUSS, SINGLET])
def test_spots_have_the_radii_of_the_librarys_diagram(path):
    from optiland.analysis import SpotDiagram

    traced = trace_prescription(path, math.inf, HALF_MM)
    angles = [0.0, 5.0, 10.0]
    lens = read_library(path, angles)
    diagram = SpotDiagram(lens, wavelengths=[0.45, 0.55, 0.65], num_rings=128, distribution="uniform")
    for field, angle in enumerate(angles):
        height = chief_mm(lens, angle / 10.0, 0.55)
        for column, nm in enumerate((450.0, 550.0, 650.0)):
            data = diagram.data[field][column]
            theirs = 1e3 * math.sqrt(np.var(np.asarray(data.x)) + np.var(np.asarray(data.y)))
            assert spot_rms_um(traced, height, nm) == pytest.approx(theirs, rel=0.02, abs=0.3)


@pytest.mark.slow
@needs_optiland
@pytest.mark.parametrize("angle", [0.0, 7.0])
def test_the_transfer_function_is_the_librarys(angle):
    """The double Gauss at f/8, where diffraction and aberrations are alike: FFT MTF against our kernel's transform, 550 nm."""
    from optiland.mtf import FFTMTF

    traced, n = trace_prescription(GAUSS, math.inf, HALF_MM), 8.0
    lens = read_library(GAUSS, [0.0, 10.0], traced.focal_length_mm / n)
    mtf = FFTMTF(lens, fields=[(0.0, angle / 10.0)], wavelength=0.55, num_rays=128, grid_size=1024)
    height = chief_mm(lens, angle / 10.0, 0.55)

    def wavefront_um(x, y):
        return traced.aberrations.wavefront_error_um(x, y, n, 550.0, (0.0, height / HALF_MM))

    size, cell_um = 255, 1.0
    kernel = compute_psf(wavefront_um, 0.55, n, cell_um, size)
    frequencies = np.array([20.0, 50.0, 100.0])  # cycles per mm
    place_um = (np.arange(size) - size // 2) * cell_um
    cell = np.sinc(frequencies * 1e-3 * cell_um)
    theirs_at = np.ravel(np.asarray(mtf.freq))
    for axis, values in ((0, mtf.mtf[0][0]), (1, mtf.mtf[0][1])):  # tangential runs down, as the field does
        line = kernel.sum(axis=1 - axis)
        ours = np.abs(np.exp(-2j * math.pi * 1e-3 * frequencies[:, None] * place_um) @ line) / line.sum() / cell
        theirs = np.interp(frequencies, theirs_at, np.ravel(np.asarray(values)))
        np.testing.assert_allclose(ours, theirs, atol=0.015)


@pytest.mark.slow
@needs_optiland
@pytest.mark.parametrize("path", [GAUSS, SINGLET])
def test_distortion_and_lateral_colour_are_those_of_chief_rays(path):
    traced = trace_prescription(path, math.inf, HALF_MM)
    lens, d = read_library(path, [0.0, 12.0]), traced.distortion
    for share in (0.3, 0.6, 0.9):
        seen = {nm: chief_mm(lens, share, 1e-3 * nm) for nm in (450.0, 550.0, 650.0)}
        r = traced.focal_length_mm * math.tan(math.radians(12.0 * share)) / HALF_MM
        assert r * (1 + d.k1 * r**2 + d.k2 * r**4 + d.k3 * r**6) * HALF_MM == pytest.approx(seen[550.0], abs=2e-3)
        for nm in (450.0, 650.0):
            tilt_um = traced.aberrations.traced.terms_um(seen[550.0] / HALF_MM, nm)[0]
            ours_um = -2 * traced.f_number * tilt_um
            assert ours_um == pytest.approx(1e3 * (seen[nm] - seen[550.0]), abs=4.0)  # the fit's error near the middle


@pytest.mark.slow
@needs_optiland
def test_fall_off_of_a_lens_without_rims_is_the_natural_one():
    traced = trace_prescription(SINGLET, math.inf, HALF_MM)
    h = np.linspace(0, 1, 6)
    natural = 1 / (1 + (h * HALF_MM / traced.focal_length_mm) ** 2) ** 2
    np.testing.assert_allclose(traced.falloff.shares(h), natural, atol=3e-3)
    open_, stopped = (trace_prescription(GAUSS, math.inf, HALF_MM, n).falloff.shares(np.array(1.0)) for n in (None, 5.6))
    assert open_ < 0.7 < 0.9 < stopped  # its rims clip the corner wide open only


@pytest.mark.slow
@needs_optiland
def test_a_near_focus_brings_the_plane_there_into_focus():
    """A point in the middle at 2 m is sharp at 2 m, and the spot of a lens focused at infinity has its blur circle."""
    near = trace_prescription(SINGLET, 2.0, HALF_MM)
    far = trace_prescription(SINGLET, math.inf, HALF_MM)
    assert spot_rms_um(near, 0.0, 587.56) < 2.5 * spot_rms_um(far, 0.0, 587.56)
    assert near.focal_length_mm == far.focal_length_mm


@pytest.mark.slow
@needs_optiland
def test_kinds_of_files_hold_the_same_lens(tmp_path):
    from optiland import fileio

    lens = fileio.load_codev_file(str(SINGLET))
    fileio.save_optiland_file(lens, str(tmp_path / "a.json"))
    fileio.save_zemax_file(lens, str(tmp_path / "a.zmx"))
    wanted = trace_prescription(SINGLET, 3.0, HALF_MM)
    for name in ("a.json", "a.zmx"):
        found = trace_prescription(tmp_path / name, 3.0, HALF_MM)
        assert found.focal_length_mm == pytest.approx(wanted.focal_length_mm, rel=1e-6)
        ours, theirs = (np.array(each.aberrations.traced.coefficients_um) for each in (wanted, found))
        np.testing.assert_allclose(theirs, ours, atol=2e-3)


SHOT = """\
scene: {{chart: grey_ramp, luminance: 100 cd/m^2}}
lens: {{prescription: {lens}, f_number: {f_number}, focus_distance: 3 m}}
exposure: {{time: 1/100 s, iso: 100}}
camera: {{base: sony_a7s2, width: {width}, height: 400}}
"""


def write_shot(folder, lens="singlet", f_number="f/8", width=600):
    (folder / "shot.yaml").write_text(SHOT.format(lens=lens, f_number=f_number, width=width))
    return folder / "shot.yaml"


@pytest.mark.slow
@needs_optiland
def test_a_shot_becomes_numbers_that_need_no_library(tmp_path):
    shot = load_shot(write_shot(tmp_path))
    assert shot.lens.model == "singlet" and shot.lens.f_number == 8.0 and shot.lens.focus_distance_m == 3.0
    assert shot.lens.focal_length_mm == pytest.approx(100, abs=0.01) and not shot.lens.cos4
    assert "prescription" not in shot.resolved["lens"]
    assert build_shot_from_data(shot.resolved, "again", {}).lens == shot.lens


@pytest.mark.slow
@needs_optiland
def test_what_a_lens_cannot_do_is_told_with_the_line(tmp_path):
    with pytest.raises(PhotositeError, match="shot.yaml:2: lens.f_number = f/4: the design opens to f/5.6"):
        load_shot(write_shot(tmp_path, f_number="f/4"))
    (tmp_path / "bad.zmx").write_text("VERS 1\nMODE SEQ\nSURF 0\n  CURV nonsense\n")
    with pytest.raises(PhotositeError, match="lens.prescription = .*bad.zmx"):
        load_shot(write_shot(tmp_path, "bad.zmx"))


def test_files_that_are_none_are_refused(tmp_path):
    with pytest.raises(PhotositeError, match="lens.prescription = .*none.zmx: no such file"):
        load_shot(write_shot(tmp_path, "none.zmx"))
    (tmp_path / "lens.txt").write_text("a lens")
    with pytest.raises(PhotositeError, match="no known kind of prescription; give one of .zmx, .seq, .json"):
        load_shot(write_shot(tmp_path, "lens.txt"))


@pytest.mark.skipif(INSTALLED, reason="Optiland is installed")
def test_a_missing_library_is_told(tmp_path):
    with pytest.raises(PhotositeError, match=r"needs Optiland.*pip install 'photosite\[prescription\]'"):
        load_shot(write_shot(tmp_path))
