"""Wavefronts and their diffraction against closed forms: Airy, Marechal, the transfer function of a circular pupil."""

import math
import sys
import types

import numpy as np
import pytest
from scipy.special import j0, j1

from simulator.errors import PhotositeError
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.optics.lens.zernike import noll_orders, zernike
from simulator.optics.psf.fraunhofer import compute_psf

WAVE_UM = 0.55


def no_error(x, y):
    return 0.0 * x


def psf(aberrations: Aberrations, f_number, cell_um, size, field_xy=(0.0, 0.0), blur_um=0.0, wavelength_nm=550.0):
    def path(x, y):
        return aberrations.wavefront_error_um(x, y, f_number, wavelength_nm, field_xy, blur_um)

    return compute_psf(path, wavelength_nm * 1e-3, f_number, cell_um, size)


def centroid(kernel) -> tuple[float, float]:
    """x and y in cells from the middle."""
    axis = np.arange(len(kernel)) - len(kernel) // 2
    return float(kernel.sum(0) @ axis / kernel.sum()), float(kernel.sum(1) @ axis / kernel.sum())


def radius_rms(kernel) -> float:
    axis = np.arange(len(kernel)) - len(kernel) // 2
    return math.sqrt(float((kernel * (axis[:, None] ** 2 + axis**2)).sum() / kernel.sum()))


@pytest.mark.parametrize("f_number", [2.0, 8.0, 22.0])
def test_a_perfect_lens_makes_the_airy_pattern(f_number):
    """(2 J1(v) / v)^2 with v = pi r / (lambda N), and its first zero at 1.2197 lambda N."""
    cell_um = 0.02 * WAVE_UM * f_number
    kernel = compute_psf(no_error, WAVE_UM, f_number, cell_um, 201)
    radius = np.arange(1, 101) * cell_um
    v = math.pi * radius / (WAVE_UM * f_number)
    peak = math.pi / 4.0 / (WAVE_UM * f_number) ** 2 * cell_um**2
    assert kernel[100, 100] == pytest.approx(peak, rel=2e-3)  # the cell's own width costs 0.1 %
    assert np.max(np.abs(kernel[100, 101:] - peak * (2 * j1(v) / v) ** 2)) < 2e-3 * peak
    zero = radius[np.argmin(kernel[100, 101:180])]
    assert zero == pytest.approx(1.21967 * WAVE_UM * f_number, abs=cell_um)


def test_the_light_inside_a_circle_follows_rayleigh():
    """1 - J0(v)^2 - J1(v)^2 (Rayleigh 1881): what a window leaves out is known, too."""
    kernel = compute_psf(no_error, WAVE_UM, 8.0, 0.5, 201)
    y, x = np.mgrid[:201, :201] - 100
    for radius_um in (10.0, 20.0, 50.0):
        v = math.pi * radius_um / (WAVE_UM * 8.0)
        inside = kernel[np.hypot(x, y) * 0.5 <= radius_um].sum()
        assert inside == pytest.approx(1.0 - j0(v) ** 2 - j1(v) ** 2, abs=2e-3)


def test_the_transfer_function_of_a_circular_pupil():
    """2/pi (acos u - u sqrt(1 - u^2)), u = lambda N nu, times the cell's sinc."""
    kernel = compute_psf(no_error, WAVE_UM, 8.0, 1.0, 801)
    frequency = np.fft.rfftfreq(801, 1.0)
    u = np.minimum(frequency * WAVE_UM * 8.0, 1.0)
    expected = 2.0 / math.pi * (np.arccos(u) - u * np.sqrt(1.0 - u**2)) * np.sinc(frequency)
    found = np.abs(np.fft.rfft(kernel.sum(axis=0)))
    assert np.max(np.abs(found - expected)[1:]) < 5e-4
    assert found[0] == pytest.approx(1.0 - 2.0 / math.pi**2 * WAVE_UM * 8.0 / 400.5 * 4 / math.pi, abs=2e-3)  # tails outside


@pytest.mark.parametrize(("index", "rms_um"), [(4, 0.02), (5, 0.03), (8, 0.02), (11, 0.03), (22, 0.02)])
def test_strehl_by_marechal(index, rms_um):
    """exp(-(2 pi rms / lambda)^2) for small errors, whatever their shape."""
    sharp = psf(Aberrations(), 4.0, 0.1, 21).max()
    found = psf(Aberrations(zernike_um={index: rms_um}), 4.0, 0.1, 21)[10, 10] / sharp
    phase = 2.0 * math.pi * rms_um / WAVE_UM
    assert found == pytest.approx(math.exp(-(phase**2)), abs=0.25 * phase**3)


def test_spherical_aberration_is_best_with_as_much_defocus_of_the_other_sign():
    """W = A (r^4 - r^2) has the least variance, A^2 / 180 (Born and Wolf 9.2); the paraxial focus is worse."""
    amount = 0.10
    sharp = psf(Aberrations(), 4.0, 0.1, 21).max()
    strehl = [
        psf(Aberrations(spherical_um=amount, defocus_um=d * amount), 4.0, 0.1, 21)[10, 10] / sharp
        for d in (0.0, -0.8, -1.0, -1.2, -2.0)
    ]
    assert np.argmax(strehl) == 2 and strehl[0] == pytest.approx(strehl[4], rel=1e-4)
    assert strehl[2] == pytest.approx(1.0 - (2 * math.pi * amount / WAVE_UM) ** 2 / 180, abs=1e-4)


@pytest.mark.parametrize("blur_um", [60.0, -90.0])
def test_far_defocus_is_the_disk_of_geometric_optics(blur_um):
    """Uniform inside; blur in front and behind look the same without aberrations."""
    kernel = psf(Aberrations(), 1.4, 2.0, 121, blur_um=blur_um)
    axis = 2.0 * (np.arange(121) - 60)
    distance = np.hypot(axis[:, None], axis)
    for share in (0.5, 0.8):
        assert kernel[distance < share * abs(blur_um)].mean() == pytest.approx(4.0 / (math.pi * blur_um**2), rel=0.02)
    assert kernel[distance < abs(blur_um) + 5.0].sum() > 0.98
    assert np.allclose(kernel, psf(Aberrations(), 1.4, 2.0, 121, blur_um=-blur_um), atol=1e-9)


def test_undercorrected_spherical_aberration_tells_front_from_back():
    """W > 0: rays of the rim cross before the sensor, so an object behind the focus (radius > 0) is blurred more."""
    behind, before = (psf(Aberrations(spherical_um=1.0), 2.8, 1.0, 101, blur_um=b) for b in (15.0, -15.0))
    assert radius_rms(behind) > 1.5 * radius_rms(before)


@pytest.mark.parametrize("field_xy", [(0.8, 0.0), (0.0, -0.6), (-0.5, 0.5)])
def test_coma_moves_the_light_towards_the_centre_by_its_ray_mean(field_xy):
    """Mean of -2 N grad W over the pupil: -2 N h W131 along the field."""
    found = centroid(psf(Aberrations(coma_um=1.0), 4.0, 1.0, 301, field_xy))
    assert found == pytest.approx([-8.0 * part for part in field_xy], abs=0.1)
    on_axis = psf(Aberrations(coma_um=1.0), 4.0, 1.0, 31)
    assert np.allclose(on_axis, psf(Aberrations(), 4.0, 1.0, 31), atol=1e-12)


def test_astigmatism_has_two_line_foci():
    """At the sagittal focus the light is a line along the field, 2 N x 2 h^2 W222 to either side."""
    kernel = psf(Aberrations(astigmatism_um=1.0), 4.0, 0.5, 161, (1.0, 0.0))
    axis = (np.arange(161) - 80) * 0.5
    along, across = kernel.sum(0), kernel.sum(1)
    for reach_um in (6.0, 12.0):  # the pupil's disk seen from the side
        t = (reach_um + 0.25) / 16.0
        share = 2.0 / math.pi * (t * math.sqrt(1.0 - t**2) + math.asin(t))
        assert along[np.abs(axis) <= reach_um].sum() == pytest.approx(share, abs=0.03)
    airy = psf(Aberrations(), 4.0, 0.5, 161).sum(1)
    assert across[np.abs(axis) <= 4.0].sum() > 0.95 * airy[np.abs(axis) <= 4.0].sum()
    shifted = psf(Aberrations(astigmatism_um=1.0, defocus_um=-1.0), 4.0, 0.5, 161, (1.0, 0.0))
    assert np.allclose(shifted, kernel.T, atol=1e-6)


def test_field_curvature_is_defocus_that_grows_with_the_square_of_the_field():
    curved = psf(Aberrations(field_curvature_um=0.8), 4.0, 1.0, 41, (0.3, 0.4))
    assert np.allclose(curved, psf(Aberrations(defocus_um=0.2), 4.0, 1.0, 41), atol=1e-12)


def test_colour_errors_are_defocus_and_shift_by_wavelength():
    lens = Aberrations(chromatic=(ChromaticShift(450.0, 80.0, 4.0), ChromaticShift(650.0, 0.0, -4.0)))
    blue = psf(lens, 4.0, 1.0, 61, (0.5, 0.0), wavelength_nm=450.0)
    assert centroid(blue) == pytest.approx((2.0, 0.0), abs=0.03)
    # Light that comes together 80 um behind the sensor has a blur circle of radius 80 / 2N = 10 um.
    assert np.allclose(
        psf(lens, 4.0, 1.0, 61, wavelength_nm=450.0), psf(Aberrations(), 4.0, 1.0, 61, blur_um=-10.0, wavelength_nm=450.0)
    )
    assert np.allclose(psf(lens, 4.0, 1.0, 61, wavelength_nm=550.0), psf(Aberrations(), 4.0, 1.0, 61, blur_um=-5.0))
    assert centroid(psf(lens, 4.0, 1.0, 61, (0.5, 0.0), wavelength_nm=700.0))[0] == pytest.approx(-2.0, abs=0.03)


def test_stopping_down_leaves_the_inner_part_of_the_wavefront():
    """Half the pupil: a sixteenth of the spherical aberration, an eighth of the coma, a quarter of the astigmatism."""
    fast = Aberrations(1.6, 0.8, 0.4, 0.2, 0.1, {4: 0.3}, at_f_number=2.0)
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 50))
    slow = Aberrations(0.1, 0.1, 0.1, 0.05, 0.025).wavefront_error_um(x, y, 4.0, 550.0, (0.6, 0.0))
    expected = slow + 0.3 * math.sqrt(3.0) * (2.0 * (x**2 + y**2) / 4.0 - 1.0)
    assert np.allclose(fast.wavefront_error_um(x, y, 4.0, 550.0, (0.6, 0.0)), expected)
    with pytest.raises(PhotositeError, match=r"lens.f_number = f/1.4: the wavefront is stated at f/2 .*stop down"):
        fast.wavefront_error_um(x, y, 1.4, 550.0)


def test_zernike_polynomials_are_orthonormal_in_nolls_order():
    assert [noll_orders(index) for index in range(1, 12)] == [
        *((0, 0), (1, 1), (1, -1), (2, 0), (2, -2), (2, 2)),
        *((3, -1), (3, 1), (3, -3), (3, 3), (4, 0)),
    ]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    radius, angle = np.sqrt(0.5 * (nodes + 1.0))[:, None], np.arange(48)[None, :] * math.tau / 48
    terms = np.array([zernike(j, radius * np.cos(angle), radius * np.sin(angle)) for j in range(1, 37)])
    gram = np.einsum("irt,jrt,r->ij", terms, terms, 0.5 * weights) / 48
    assert np.allclose(gram, np.eye(36), atol=1e-10)


def test_what_cannot_be_is_refused():
    with pytest.raises(PhotositeError, match="lens.aberrations.chromatic .*ascending"):
        Aberrations(chromatic=(ChromaticShift(550.0), ChromaticShift(450.0)))
    with pytest.raises(PhotositeError, match="zernike index = 0: .*1 to 231"):
        Aberrations(zernike_um={0: 0.1})
    with pytest.raises(PhotositeError, match=r"lens.aberrations = \d+ waves per pupil radius: .*lessen"):
        psf(Aberrations(spherical_um=900.0), 2.0, 4.0, 31)


@pytest.mark.slow
def test_prysm_finds_the_same_pattern(monkeypatch):
    """An independent optics library on a wavefront with every kind of term; its pupil has a hard rim, ours a smoothed one."""
    # prysm 0.21.1 asks pkg_resources for its own version; setuptools 81 and later have none.
    told = types.SimpleNamespace(
        get_distribution=lambda name: types.SimpleNamespace(version="0.21.1"), DistributionNotFound=Exception
    )
    monkeypatch.setitem(sys.modules, "pkg_resources", told)
    reason = "prysm is not installed: pip install 'photosite[peers]'"
    propagation = pytest.importorskip("prysm.propagation", reason=reason)
    lens = Aberrations(-0.4, 0.5, 0.3, 0.2, zernike_um={8: 0.1, 10: 0.05})
    x, y = np.meshgrid(np.linspace(-1, 1, 1024), np.linspace(-1, 1, 1024))
    path_nm = 1e3 * lens.wavefront_error_um(x, y, 4.0, 550.0, (0.6, 0.3))
    rim = (np.hypot(x, y) <= 1.0).astype(float)
    # prysm: pupil coordinates in mm, focal length in mm for f/4 with this pupil of 2 mm; its phase has the other sign.
    wave = propagation.Wavefront.from_amp_and_phase(rim, -path_nm, WAVE_UM, x[0, 1] - x[0, 0])
    peer = wave.focus_fixed_sampling(8.0, 0.25, 161).intensity.data
    own = psf(lens, 4.0, 0.25, 161, (0.6, 0.3))
    assert np.max(np.abs(peer / peer.sum() - own / own.sum())) < 5e-3 * (own / own.sum()).max()
