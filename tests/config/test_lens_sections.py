"""Diffraction, aberrations, PSF files and low-pass filter in a shot file: read, found again, refused, explained."""

import json
import re

import numpy as np
import pytest
from scipy.signal import convolve2d

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.pipeline.planner import plan
from simulator.pipeline.simulate import simulate
from simulator.raw.save import save
from simulator.studies.resimulation import shot_of

SHOT = """
scene: {{image: scene.npy, luminance: 100 cd/m^2, illuminant: D65, depth: {depth}}}
lens: {lens}
exposure: {{time: 1/60 s, iso: 100}}
camera: {{base: sony_a7s2, width: 64, height: 48, {camera}stages: {{photon_shot_noise: null}}}}
"""
THIN = "focal_length: 50 mm, f_number: f/8, focus_distance: 2 m"


def write_shot(folder, lens=THIN, camera="", depth="2 m", bright=None):
    picture = np.full((48, 64), 0.5, np.float32)
    picture[24, 32] = 0.9 if bright is None else bright
    np.save(folder / "scene.npy", picture)
    path = folder / "shot.yaml"
    path.write_text(SHOT.format(lens="{" + lens + "}", camera=camera, depth=depth))
    return path


def kernel(size=5) -> np.ndarray:
    found = np.random.default_rng(2).random((size, size))
    return found / found.sum()


def test_a_shot_file_states_diffraction_and_aberrations(tmp_path):
    aberrations = "spherical: 0.4 um, zernike: {7: 0.05 um}, at_f_number: f/4, chromatic: [{wavelength: 450 nm, focus: 40 um}]"
    shot = load_shot(write_shot(tmp_path, f"{THIN}, aberrations: {{{aberrations}}}", "low_pass: 2.1 um, fill_factor: 0.8, "))
    assert shot.lens.aberrations == Aberrations(
        spherical_um=0.4, zernike_um={7: 0.05}, at_f_number=4.0, chromatic=(ChromaticShift(450.0, 40.0),)
    )
    assert shot.camera.low_pass_um == 2.1 and load_shot(write_shot(tmp_path, f"{THIN}, diffraction: true")).lens.diffraction
    hole = "pinhole: {diameter: 0.3 mm, distance: 50 mm, diffraction: true}"
    assert load_shot(write_shot(tmp_path, hole)).lens.diffraction


def test_a_psf_file_is_applied_and_found_again(tmp_path):
    """Two-dimensional sum in float64; the path is relative to the shot, the DNG with its hash gives the frame again."""
    psf = kernel()
    np.save(tmp_path / "psf.npy", psf)
    sharp, spread = (simulate(load_shot(write_shot(tmp_path, lens))) for lens in (THIN, f"{THIN}, psf: psf.npy"))
    excess = np.zeros((48, 64))
    excess[24, 32] = 0.4 / 0.5
    expected = 1.0 + convolve2d(excess, psf, mode="same")
    assert np.allclose(spread.mean_electrons / sharp.mean_electrons * (1.0 + excess), expected, rtol=2e-5)
    assert [one["key"] for one in spread.resolved["inputs"]] == ["scene.image", "lens.psf"]
    files = save(spread, tmp_path)
    assert json.loads(files.sidecar.read_text())["shot"]["lens"]["psf"] == str(tmp_path / "psf.npy")
    assert np.array_equal(simulate(shot_of(files.dng)).dn, spread.dn)
    np.save(tmp_path / "psf.npy", kernel(7))
    with pytest.raises(PhotositeError, match=r"lens.psf = .*psf.npy: its content is not what it was"):
        shot_of(files.dng)


def test_a_kernel_larger_than_the_frame_spreads_all_of_its_light(tmp_path):
    np.save(tmp_path / "psf.npy", np.full((101, 101), 1.0 / 101**2))
    found = simulate(load_shot(write_shot(tmp_path, f"{THIN}, psf: psf.npy", bright=50.0))).mean_electrons
    block = found[::2, ::2]
    assert np.ptp(block) / block.mean() < 1e-3  # cos^4 alone: the light lies evenly over all of the frame


def table(path, radii, fields=(0.0,), **settings):
    shape = (len(radii), len(fields), 1, 9, 9)
    np.savez(path, kernels=np.full(shape, 1.0 / 81), blur_radii_px=radii, fields=fields, **settings)


WRONG = {
    "psf: nothing.npy": r"nothing.npy: no such file; check the path",
    "psf: psf.dat": r"psf.dat: no known kind of PSF file; give .npz, .npy, .txt or .csv",
    "psf: heavy.npy": r"heavy.npy: kernel \(0, 0, 0\) sums to 2, not to 1: divide it by its sum",
    "psf: two.npy": r"two.npy: channels of the kernels = 2: the camera has 3; give one for each, or one for all",
    "psf: good.npy, diffraction: true": r"shot.yaml:3: lens.psf = .*good.npy: a PSF holds the diffraction .* leave lens.diffr",
    "psf: good.npy, aberrations: {coma: 1 um}": r"lens.psf = .*good.npy: .*; leave lens.aberrations out",
    "aberrations: {at_f_number: f/11}": r"lens.f_number = f/8: the wavefront is stated at f/11 and unknown beyond",
    "aberrations: {coma: 1}": r"lens.aberrations.coma = 1: has no unit; write a length such as",
    "aberrations: {comma: 1 um}": r"unknown key lens.aberrations.comma|lens.aberrations.comma.*coma",
    "aberrations: {spherical: 4 mm}": r"lens.aberrations",
    "bare_sensor: {}, diffraction: true": r"lens.diffraction|unknown",
}


@pytest.mark.parametrize("lens", WRONG)
def test_wrong_lenses_are_refused_with_one_message(tmp_path, lens):
    (tmp_path / "psf.dat").write_text("1")
    np.save(tmp_path / "heavy.npy", 2.0 * kernel())
    np.save(tmp_path / "two.npy", np.stack([kernel(), kernel()]))
    np.save(tmp_path / "good.npy", kernel())
    stated = lens if lens.startswith("bare") else f"{THIN}, {lens}"
    with pytest.raises(PhotositeError, match=WRONG[lens]):
        simulate(load_shot(write_shot(tmp_path, stated)))


def test_a_table_that_does_not_reach_the_scene_s_blur_is_refused(tmp_path):
    table(tmp_path / "psf.npz", [-1.0, 0.0, 1.0])
    lens = "focal_length: 50 mm, f_number: f/2, focus_distance: 2 m, psf: psf.npz"
    with pytest.raises(PhotositeError, match=r"lens.psf: blur of the scene = .*holds blur radii from -1 to 1; tabulate more"):
        plan(load_shot(write_shot(tmp_path, lens, depth="3 m")))


@pytest.mark.parametrize("camera", ["low_pass: -1 um, ", "low_pass: 2 mm, ", "fill_factor: 0, "])
def test_wrong_filters_and_apertures_are_refused(tmp_path, camera):
    with pytest.raises(PhotositeError, match=r"camera.(low_pass|fill_factor) = "):
        load_shot(write_shot(tmp_path, camera=camera))


def reasons(path) -> dict[str, tuple[bool, str]]:
    return {step.stage: (step.kept, step.why) for step in plan(load_shot(path)).steps}


def test_explain_tells_what_is_kept_and_why(tmp_path):
    reason = reasons(write_shot(tmp_path))
    assert reason["diffraction"] == (
        False,
        "lens.diffraction is not set; the Airy disk is 1.31 photosites wide (2.44 lambda N at 550 nm)",
    )
    assert not any(reason[step][0] for step in ("aberrations", "low-pass filter", "pixel aperture"))
    reason = reasons(write_shot(tmp_path, f"{THIN}, aberrations: {{coma: 0.5 um}}", "low_pass: 4.2 um, fill_factor: 0.81, "))
    assert (
        reason["diffraction"][0]
        and "kernels of" in reason["diffraction"][1]
        and re.match(r"kernels at \d+ x \d+ places", reason["aberrations"][1])
    )
    assert reason["low-pass filter"] == (True, "four spots 4.2 um apart: no contrast at 1 cycles per photosite")
    assert reason["pixel aperture"] == (True, "sensitive squares of 0.9 photosites: sinc(0.9 nu) instead of sinc(nu)")
    far = "focal_length: 50 mm, f_number: f/1.4, focus_distance: 0.5 m, diffraction: true"
    assert "follows the geometric blur" in reasons(write_shot(tmp_path, far, depth="infinity"))["diffraction"][1]


def test_what_cannot_be_seen_is_skipped(tmp_path):
    """A scene without detail, and one whose detail is far below the noise."""
    for bright, why in ((0.5, "the scene is the same everywhere"), (0.5 + 1e-6, "changes nothing by more than")):
        path = write_shot(tmp_path, f"{THIN}, diffraction: true", "low_pass: 2 um, ", bright=bright)
        reason, planned = reasons(path), plan(load_shot(path))
        assert planned.optics.psf is None and not reason["diffraction"][0] and not reason["low-pass filter"][0]
        assert why in reason["diffraction"][1] and why in reason["low-pass filter"][1]
