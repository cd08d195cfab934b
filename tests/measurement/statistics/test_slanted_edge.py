"""The slanted edge finds transfer functions that are known: Gaussian, box, diffraction; in arrays and in raw files."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.psf_grid import PsfGrid, convolve
from helpers.raw_frame import random_frame
from helpers.scene_builders import band_scene, distances, scene_edge
from scipy.special import erf

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.statistics.slanted_edge import edge_of_raw_file, edge_transfer
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.dng.writer import write_dng
from simulator.raw.save import save

FREQUENCY = np.linspace(0.02, 0.5, 25)


def gaussian_edge(sigma_px, angle_deg, width=80, height=120) -> np.ndarray:
    return 200.0 + 800.0 * 0.5 * (1.0 + erf(distances(width, height, angle_deg) / (sigma_px * math.sqrt(2.0))))


@pytest.mark.parametrize("angle_deg", [3.0, 5.7, -8.0, 12.0, 25.0])
@pytest.mark.parametrize("sigma_px", [0.5, 1.0, 2.0])
def test_a_gaussian_edge_has_a_gaussian_transfer(sigma_px, angle_deg):
    """exp(-2 (pi sigma nu)^2): the signal is the convolution itself at each photosite's centre, in float64."""
    found = edge_transfer(gaussian_edge(sigma_px, angle_deg))
    assert np.max(np.abs(found.at(FREQUENCY) - np.exp(-2.0 * (math.pi * sigma_px * FREQUENCY) ** 2))) < 0.01
    assert found.angle_deg == pytest.approx(abs(angle_deg), abs=0.03) and found.step == pytest.approx(800.0, rel=1e-3)
    if sigma_px == 0.5:  # the responses of bin and difference, 0.97 and 0.90 at the end, are off to a part in a hundred
        assert np.allclose(found.at(FREQUENCY), np.exp(-2.0 * (math.pi * sigma_px * FREQUENCY) ** 2), rtol=0.01)
    if sigma_px >= 1.0:
        assert found.mtf50_per_px == pytest.approx(math.sqrt(math.log(2.0) / 2.0) / (math.pi * sigma_px), rel=0.015)


def test_edges_in_any_direction_and_of_either_sign_are_the_same():
    edge = gaussian_edge(1.0, 5.7)
    expected = edge_transfer(edge).at(FREQUENCY)
    for turned in (edge.T, edge[:, ::-1], edge[::-1].T, 2000.0 - edge):
        assert np.allclose(edge_transfer(turned).at(FREQUENCY), expected, atol=3e-3)


def test_green_photosites_alone_tell_as_much_as_all():
    """A checkerboard of places: beyond the Nyquist limit of one plane, 0.25 per pixel, too."""
    edge = gaussian_edge(0.6, 5.7, 80, 160)
    seen = (np.add.outer(np.arange(160), np.arange(80)) % 2) == 0
    found = edge_transfer(np.where(seen, edge, -1e6), seen)
    assert np.max(np.abs(found.at(FREQUENCY) - np.exp(-2.0 * (math.pi * 0.6 * FREQUENCY) ** 2))) < 0.01


def test_noise_moves_the_result_but_not_its_mean():
    """White noise of 1 % of the step: the mean of 40 frames lies within its standard error and the noise's power."""
    rng, edge = np.random.default_rng(1), gaussian_edge(1.0, 5.7)
    found = np.array([edge_transfer(edge + rng.normal(0.0, 8.0, edge.shape)).at(FREQUENCY[:12]) for _ in range(40)])
    error = found.mean(axis=0) - np.exp(-2.0 * (math.pi * FREQUENCY[:12]) ** 2)
    assert np.all(np.abs(error) < 4.0 * found.std(axis=0, ddof=1) / math.sqrt(40) + 0.004)


def taken(tmp_path, lens, depth_m, cfa="MONO"):
    """DNG of the edge, taken without noise, 96 x 128 photosites of 5 um."""
    camera = small_camera(96, 128, cfa)
    planes = scene_edge(5.7)
    planes = np.repeat(planes[..., None], camera.channels, axis=2)
    exposure = 0.01
    light = simulate(
        Shot(band_scene(planes, depth_m, interpolation="nearest"), lens, Exposure(exposure), camera)
    ).mean_electrons
    shot = Shot(band_scene(planes, depth_m, interpolation="nearest"), lens, Exposure(exposure * 50000.0 / light.max()), camera)
    return save(simulate(shot), tmp_path)


@pytest.mark.parametrize("cfa", ["MONO", "GRBG"])
def test_a_sharp_raw_file_shows_the_aperture_of_its_photosites(tmp_path, cfa):
    """sinc of the photosite along the normal of the edge, from the DNG through LibRaw."""
    taken(tmp_path, ThinLens(50.0, 8.0, 2.0, cos4=False), 2.0, cfa)
    found = edge_of_raw_file(next(tmp_path.glob("*.dng")), "MONO" if cfa == "MONO" else "G")
    angle = math.radians(5.7)
    expected = np.sinc(FREQUENCY * math.cos(angle)) * np.sinc(FREQUENCY * math.sin(angle))
    assert np.max(np.abs(found.at(FREQUENCY) - expected)) < 0.012


def pupil_transfer(frequency_per_um, f_number, blur_um) -> np.ndarray:
    """Autocorrelation of a circular pupil with defocus W = blur r^2 / 4 N along its shift (Hopkins 1955), summed in float64."""
    axis = np.linspace(-1.0, 1.0, 801)
    x, y = axis[None, :], axis[:, None]
    found = []
    for u in frequency_per_um * 0.55 * f_number:
        overlap = ((np.abs(x) + u) ** 2 + y**2 <= 1.0).astype(float)
        slope_waves = blur_um / (4.0 * f_number) / 0.55 * 4.0 * u
        found.append((overlap * np.cos(2.0 * math.pi * slope_waves * x)).sum())
    return np.array(found) / (x**2 + y**2 <= 1.0).sum()


@pytest.mark.parametrize(("f_number", "blur_um"), [(8.0, 0.0), (8.0, 9.0), (2.8, 12.0)])
def test_diffraction_and_defocus_of_a_lens_are_found_again(f_number, blur_um):
    """The kernels of wave optics on a grid of quarter photosites, then photosites of 4 um: the pupil's transfer times sinc."""
    lens = WavefrontPsf(Aberrations(), f_number, 1.0, ((550.0,),), 251, cells=1)
    kernel = PsfGrid(lens.kernel(0, blur_um, (0.0, 0.0))[None, None, None], np.zeros(1), np.zeros(1))
    fine = convolve(scene_edge(5.7, 4)[None], kernel)[0]
    found = edge_transfer(fine.reshape(128, 4, 96, 4).mean(axis=(1, 3)))
    frequency = np.linspace(0.02, 0.45, 20)
    expected = np.abs(pupil_transfer(0.25 * frequency, f_number, blur_um))
    grids = np.sinc(frequency) * np.sinc(0.25 * frequency)  # of the photosite, and of the cells that hold the kernel
    assert np.max(np.abs(found.at(frequency) - expected * grids)) < 0.015


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (np.full((60, 60), 100.0), "no single edge|no edge"),
        (np.random.default_rng(2).normal(100.0, 10.0, (60, 60)), "no single edge|no edge"),
        (gaussian_edge(1.0, 0.3), "0.30 degrees off the photosites' axis; turn it"),
        (gaussian_edge(1.0, 5.0, 80, 20), "too few rows|crossing two columns"),
        (np.ones((8, 40)), r"\(8, 40\): give a part of at least 16 x 16"),
    ],
)
def test_what_is_no_slanted_edge_is_refused(signal, message):
    with pytest.raises(PhotositeError, match=message):
        edge_transfer(signal)


def test_a_colour_or_a_part_that_a_file_has_not_is_refused(tmp_path):
    taken(tmp_path, ThinLens(50.0, 8.0, 2.0, cos4=False), 2.0, "RGGB")
    path = next(tmp_path.glob("*.dng"))
    with pytest.raises(PhotositeError, match=r"dng: colour = MONO: give one of R, G, B"):
        edge_of_raw_file(path, "MONO")
    with pytest.raises(PhotositeError, match=r"dng: window = \(0, 0, 97, 10\): must lie inside 96 x 128"):
        edge_of_raw_file(path, "G", (0, 0, 97, 10))


def test_a_file_whose_edge_clips_is_refused(tmp_path):
    raw = random_frame(120, 80, "MONO", 14, white_level_dn=600)
    dn = np.minimum(gaussian_edge(1.0, 5.7), 600.0).astype(np.uint16)
    write_dng(dataclasses.replace(raw, dn=dn), tmp_path / "bright.dng")
    with pytest.raises(PhotositeError, match=r"bright\.dng: \d+ at or above the white level of 600 DN of 9600 photosites"):
        edge_of_raw_file(tmp_path / "bright.dng", "MONO")
