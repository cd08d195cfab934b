"""End to end against numbers worked out by hand: constants, formulas and reference values R1-R8, R13-R17, R20.

R numbers are those of the simulators' comparison the project was designed on: ISETCam's published anchor (R3)
and values computed from SI constants alone. The truth here is float64 arithmetic written out in the test.
"""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import FixedScene, band_scene

from simulator.color.spectra import luminous_efficiency
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import IsoSetting, SpectralResponse
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.registry import STAGES

H, C, KM = 6.62607015e-34, 299792458.0, 683.0
PRECISION = 1e-3  # 0.1 %, what the reference numbers are given to
# The published numbers are sums over 31 bands of 10 nm with their middles at 400 to 700 nm: 395 to 705 nm.
EE = np.arange(395.0, 706.0, 10.0)


def equal_energy(luminance: float, depth_m=math.inf, size=4) -> FixedScene:
    """Uniform equal-energy light from 395 to 705 nm of this luminance [cd m^-2]."""
    radiance = luminance / (KM * 10.0 * luminous_efficiency(EE[:-1] + 5.0).sum())  # W m^-2 sr^-1 nm^-1
    return FixedScene(Scene(np.ones((size, size, 1), np.float32), np.full((1, 32), radiance), EE, np.ones(32), depth_m))


def green_line(luminance: float) -> FixedScene:
    """Uniform light of 555 nm, a triangle of 1 nm at half its height, of this luminance."""
    grid = np.array([554.0, 555.0, 556.0])
    line = np.array([[0.0, luminance / (KM * luminous_efficiency(grid)[1]), 0.0]])
    return FixedScene(Scene(np.ones((4, 4, 1), np.float32), line, grid, np.ones(3), math.inf))


def photon_counter(pitch_um=2.8, **settings):
    """A camera with quantum efficiency 1 from 395 to 705 nm."""
    return small_camera(pixel_pitch_um=pitch_um, response=SpectralResponse(EE, np.ones((32, 1))), **settings)


def mean_electrons(scene, lens, time_s, camera) -> float:
    return float(simulate(Shot(scene, lens, Exposure(time_s), camera)).mean_electrons.mean(dtype=np.float64))


def test_photons_of_a_lux():
    """R4, equal energy: 1.17651e16 photons s^-1 sr^-1 m^-2 per cd/m^2, so 11765 per um^2 and lx s; R5, 555 nm: 4091."""
    camera = photon_counter().response
    for light, photons in ((equal_energy(1.0), 11765.0), (green_line(1.0), 4091.0)):
        weights = electron_radiance_weights(light.load(), camera.wavelengths_nm, camera.quantum_efficiency)
        assert weights.sum() == pytest.approx(photons, rel=PRECISION)


@pytest.mark.parametrize(
    ("f_number", "form", "expected"),
    [(4.0, "thin_lens", 4458), (4.0, "aplanatic", 4528), (1.4, "thin_lens", 32780), (1.4, "aplanatic", 36961)],
)
def test_photons_per_photosite(f_number, form, expected):
    """R6: 100 cd/m^2, 2.8 um, 10 ms, focused at infinity; R1 and R2 are the two forms."""
    lens = ThinLens(4.0, f_number, irradiance=form, cos4=False)
    found = mean_electrons(equal_energy(100.0), lens, 0.01, photon_counter())
    assert found == pytest.approx(expected, rel=PRECISION)


@pytest.mark.parametrize(("form", "expected"), [("thin_lens", 1550), ("aplanatic", 1574)])
def test_photons_of_a_green_line(form, expected):
    """R6 at 555 nm, f/4."""
    lens = ThinLens(4.0, 4.0, irradiance=form, cos4=False)
    assert mean_electrons(green_line(100.0), lens, 0.01, photon_counter()) == pytest.approx(expected, rel=PRECISION)


def test_end_to_end_anchor():
    """R3: ISETCam prints 3316.13 e-/s for this set-up; the formulas in float64 give 3318.64."""
    lens = ThinLens(3.8628, 4.0, focus_distance_m=1.2)
    assert lens.magnification == pytest.approx(3.2293e-3, rel=PRECISION)  # R8: f / (d - f)
    camera = photon_counter(width=88, height=72, fill_factor=0.75)
    found = mean_electrons(equal_energy(1.0, depth_m=1.2), lens, 1.0, camera)
    assert found == pytest.approx(3318.64, rel=1e-4)
    assert found == pytest.approx(3316.1333, rel=PRECISION)


@pytest.mark.parametrize("f_number", [2.0, 4.0, 8.0, 16.0, 32.0])
def test_light_against_f_number(f_number):
    """R7: proportional to 1 / (1 + 4 N^2 (1 + m)^2), not to 1 / N^2."""
    lens = ThinLens(50.0, f_number, focus_distance_m=1.0, cos4=False)
    found = mean_electrons(equal_energy(100.0, depth_m=1.0), lens, 0.01, photon_counter())
    m = 0.05 / (1.0 - 0.05)
    photons = 100.0 * 1.17651e16 * math.pi / (1 + 4 * f_number**2 * (1 + m) ** 2) * 2.8e-6**2 * 0.01
    assert found == pytest.approx(photons, rel=PRECISION)


def test_meter_constant_of_iso_12232():
    """R20: H = 0.6516 L t / N^2 with a lens of 0.9 transmittance, 0.98 for its magnification, 10 degrees off axis."""
    lens = ThinLens(50.0, 8.0, transmittance=0.9 * 0.98, irradiance="aplanatic", cos4=False)
    exposure_lx_s = 100.0 * lens.irradiance_per_radiance_sr() * math.cos(math.radians(10.0)) ** 4 * 0.01
    assert exposure_lx_s == pytest.approx(0.6516 * 100.0 * 0.01 / 64.0, rel=PRECISION)  # the standard rounds to 0.65


@pytest.mark.parametrize(("scene", "photons_per_um2"), [(green_line, 3191.0), (equal_energy, 78 / 100 * 11765.1)])
def test_photons_that_saturate_at_iso_100(scene, photons_per_um2):
    """R20: H_sat = 78 / 100 lx s is 3191 photons per um^2 at 555 nm, and 0.78 of R4 for equal-energy light."""
    lens, luminance = ThinLens(50.0, 4.0, cos4=False), 100.0
    time_s = 0.78 / (luminance * lens.irradiance_per_radiance_sr())
    found = mean_electrons(scene(luminance), lens, time_s, photon_counter(pitch_um=1.0))
    assert found == pytest.approx(photons_per_um2, rel=PRECISION)


def test_cos4_falloff_towards_the_corner():
    """R9: E(r) = E(0) (z / sqrt(z^2 + r^2))^4."""
    lens = ThinLens(4.0, 4.0)
    electrons = simulate(
        Shot(equal_energy(100.0), lens, Exposure(0.01), photon_counter(30.0, width=64, height=48))
    ).mean_electrons
    y, x = np.mgrid[:48, :64] + 0.5
    r2 = ((x - 32) ** 2 + (y - 24) ** 2) * 0.030**2
    expected = 4458.0 * (30.0 / 2.8) ** 2 * (16.0 / (16.0 + r2)) ** 2
    assert np.abs(electrons / expected - 1).max() < PRECISION


def test_ccd_noise_variance():
    """R13 (GalSim CCDNoise): S = 50 ADU, 3 e-/ADU, 5 e- read noise give a variance of 19.4444 ADU^2, plus 1/12 of rounding."""
    stages = {"photon_shot_noise": STAGES["photon_shot_noise"]()}
    camera = small_camera(512, 512, black_level_dn=100.0, iso_table={100: IsoSetting(1 / 3, 5 / 3)}, stages=stages)
    scene = band_scene(np.ones((4, 4)), math.inf)
    lens = ThinLens(50.0, 8.0, cos4=False)
    per_second = mean_electrons(scene, lens, 1.0, camera)
    raw = simulate(Shot(scene, lens, Exposure(150.0 / per_second), camera, Seeds(frame=3)))
    variance = 19.4444 + 1 / 12
    accept({"mean": mean_p(raw.dn, 150.0, variance), "variance": variance_p(raw.dn, variance, 1 / 150)})


def test_photon_transfer_gives_back_gain_and_read_noise():
    """R15: variance = K^2 sigma^2 + 1/12 + K (mean - black), measured from pairs; slope and intercept by z-test."""
    gain, read_dn, after_dn, black = 0.7, 3.0, 1.0, 256.0
    stages = {"photon_shot_noise": STAGES["photon_shot_noise"]()}
    camera = small_camera(
        512,
        512,
        bit_depth=14,
        black_level_dn=black,
        iso_table={100: IsoSetting(gain, read_dn)},
        read_noise_after_gain_dn=after_dn,
        stages=stages,
    )
    lens, scene = ThinLens(50.0, 8.0, cos4=False), band_scene(np.ones((4, 4)), math.inf)
    per_second = mean_electrons(scene, lens, 1.0, camera)
    means, variances = [], []
    for index, electrons in enumerate([1e-9, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0]):
        exposure = Exposure(electrons / per_second)
        a, b = (simulate(Shot(scene, lens, exposure, camera, Seeds(frame=2 * index + k))).dn.astype(float) for k in (0, 1))
        means.append(0.5 * (a + b).mean() - black)
        variances.append(0.5 * np.var(a - b, ddof=1))
    means, variances = np.array(means), np.array(variances)
    sigmas = variances * math.sqrt(2.0 / (512 * 512))  # chi-square of the differences
    (slope, intercept), covariance = np.polyfit(means, variances, 1, w=1 / sigmas, cov="unscaled")
    z_slope = (slope - gain) / math.sqrt(covariance[0, 0])
    z_intercept = (intercept - read_dn**2 - 1 / 12) / math.sqrt(covariance[1, 1])
    assert abs(z_slope) < 3.5 and abs(z_intercept) < 3.5, (slope, intercept)


def test_equal_exposure_pairs_gather_equal_light():
    """H = E t: one stop more aperture for half the time, with exact stops and the aplanatic form."""
    camera, scene = photon_counter(), equal_energy(100.0)
    wide = mean_electrons(scene, ThinLens(50.0, 4.0, irradiance="aplanatic", cos4=False), 1 / 250, camera)
    narrow = mean_electrons(scene, ThinLens(50.0, 8.0, irradiance="aplanatic", cos4=False), 4 / 250, camera)
    assert wide == pytest.approx(narrow, rel=1e-6)


def test_degenerate_frames_are_exact():
    """No light: the black level everywhere. No noise: the rounded mean. Too much light: the largest code."""
    camera = small_camera(bit_depth=12, black_level_dn=64.0, iso_table={100: IsoSetting(0.5, 0.0)})
    lens = ThinLens(50.0, 8.0, cos4=False)
    dark = simulate(Shot(band_scene(np.zeros((4, 4)), math.inf), lens, Exposure(0.01), camera))
    assert (dark.dn == 64).all() and not dark.mean_electrons.any()
    scene = band_scene(np.ones((4, 4)), math.inf)
    per_second = mean_electrons(scene, lens, 1.0, camera)
    plain = simulate(Shot(scene, lens, Exposure(1000.4 / per_second), camera))
    assert (plain.dn == 64 + 500).all()
    assert simulate(Shot(scene, lens, Exposure(1e6 / per_second), camera)).dn.min() == 4095


@pytest.mark.parametrize("cfa", ["RGGB", "BGGR", "GRBG", "GBRG"])
def test_every_bayer_phase_puts_its_colours_where_it_says(cfa):
    """A scene of pure red, green or blue light reaches only the photosites of that colour."""
    camera, lens = small_camera(cfa=cfa), ThinLens(50.0, 8.0, cos4=False)
    for band, letter in ((2, "R"), (1, "G"), (0, "B")):
        planes = np.zeros((4, 4, 3))
        planes[..., band] = 1.0
        raw = simulate(Shot(band_scene(planes, math.inf), lens, Exposure(0.01), camera))
        lit = np.array([[raw.mean_electrons[y, x] > 0 for x in (0, 1)] for y in (0, 1)])
        assert np.array_equal(lit, np.array([c == letter for c in cfa]).reshape(2, 2)), (cfa, letter)
        assert raw.cfa == cfa
