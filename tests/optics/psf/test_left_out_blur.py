"""What is told of blur circles that are left out behind a point spread function bounds what float64 finds."""

import dataclasses

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene
from scipy.special import j1

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.left_out_blur import left_out_error, sharpness
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.pipeline.planner import plan
from simulator.pipeline.scene_loading import load_scene
from simulator.pipeline.shot import Shot

SIZE, PARTS, SCALE, PITCH_UM = 36, 16, 4, 4.0
LENS_WITH_WAVES = dataclasses.replace(LENS, diffraction=True)
BRIGHT = Accuracy(electrons=1.0, read_noise_e=1e3)  # the same noise in the light as in the dark


def spread_by(radius_px, ratio, frequency):
    """Transfer of a pupil's wave with its curvature, less that in focus; ratio: wavelength times f-number; 0: of a disk."""
    if ratio == 0.0:
        turn = 2.0 * np.pi * radius_px * np.maximum(frequency, 1e-9)
        return 2.0 * j1(turn) / turn - 1.0
    rim = 0.5 / ratio

    def transfer(radius_px):
        wave = np.exp(1j * np.pi * radius_px * frequency**2 / rim)
        light = np.abs(np.fft.ifft2(np.clip((rim - frequency) * SIZE + 0.5, 0.0, 1.0) * wave)) ** 2
        return np.fft.fft2(light / light.sum()).real

    return transfer(radius_px) - transfer(0.0)


def rectangles(rng):
    """Bright and dark rectangles of one to eight photosites, (pixels, pixels)."""
    pixels = np.full((SCALE * SIZE, SCALE * SIZE), 0.5)
    for _ in range(SIZE):
        (top, left), (high, wide) = rng.integers(0, SCALE * SIZE, 2), rng.integers(SCALE, 8 * SCALE, 2)
        pixels[top : top + high, left : left + wide] = rng.integers(0, 2)
    return pixels


@pytest.mark.parametrize("ratio", [0.0, 0.15, 0.34, 0.7])  # wavelength times f-number [photosites]
@pytest.mark.parametrize("sampling", [Sampling(), Sampling(0.6), Sampling(low_pass_um=0.7 * PITCH_UM)])
def test_circles_that_are_left_out_keep_to_their_law(ratio, sampling):
    """Edges and random pixels, four to a photosite, through the optics with defocus and in focus, the spots and open areas."""
    along = np.fft.fftfreq(SIZE * PARTS, 1.0 / PARTS)
    frequency, rng = np.hypot(along[:, None], along), np.random.default_rng(3)
    parts = np.sinc(along / PARTS) * np.exp(-1j * np.pi * along / PARTS)  # even squares, aside by a half
    line = sampling.transfer(along / PITCH_UM, PITCH_UM) * parts
    lens = WavefrontPsf(Aberrations(), ratio * PITCH_UM / 0.55, PITCH_UM, ((550.0,),), 1) if ratio else None
    shares: list[float] = []
    for pixels in (rectangles(rng), rng.random((SCALE * SIZE, SCALE * SIZE))):
        light = np.fft.fft2(np.kron(pixels, np.ones((PARTS // SCALE, PARTS // SCALE)))) * line[:, None] * line
        scene = load_scene(band_scene(pixels, 2.0))
        for radius_px in (0.2, 0.3):
            error = np.fft.ifft2(light * spread_by(radius_px, ratio, frequency)).real[PARTS // 2 :: PARTS, PARTS // 2 :: PARTS]
            told = left_out_error(scene, np.ones((1, 1)), BRIGHT, float(SCALE), radius_px, lens, sampling.footprint(PITCH_UM))
            shares.append(float(np.quantile(np.abs(error[3:-3, 3:-3]), 0.999)) / told)
    assert 0.3 < max(shares) <= 1.0


def test_a_shot_states_what_circles_bring_over_borders_behind_a_sharp_lens():
    """Random squares of a photosite: what the circle leaves behind a lens twice as fast is more, up to what a circle leaves."""
    pixels = np.kron(np.random.default_rng(6).random((24, 24)), np.ones((4, 4)))
    scene = band_scene(pixels, float(depth_of(0.03)))
    optics = plan(Shot(scene, LENS_WITH_WAVES, Exposure(0.001), small_camera(24, 24), tolerance=1.0)).optics
    assert optics.defocus is None and optics.ignored_px > 0.0 and optics.psf is not None
    assert isinstance(optics.psf.lens_psf, WavefrontPsf)
    to_share = optics.accuracy.electrons_per_radiance / optics.accuracy.electrons * optics.weights

    def left(lens):
        return left_out_error(optics.scene, to_share, optics.accuracy, optics.projection.scale, optics.ignored_px, lens)

    assert optics.contrast.crossed == left(optics.psf.lens_psf)
    lenses = [dataclasses.replace(optics.psf.lens_psf, f_number=f_number) for f_number in (0.5, 1.0, 2.0)]
    faster = [left(lens) for lens in lenses]
    assert left(None) >= faster[0] > faster[1] > faster[2]


def test_the_line_of_a_file_is_as_sharp_as_its_cells_tell():
    kernels = np.zeros((1, 1, 1, 15, 15), np.float32)
    kernels[..., 6:9, 7] = 1.0 / 3.0
    assert sharpness(PsfTable(kernels, np.zeros(1), np.zeros(1), 3, PITCH_UM)) == pytest.approx(3.0)
    assert sharpness(PsfTable(kernels, np.zeros(1), np.zeros(1), 1, PITCH_UM)) == np.inf
