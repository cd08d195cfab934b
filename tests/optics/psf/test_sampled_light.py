"""What kernels of a lens leave of light that bends within its samples is bounded by its law, in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates

from simulator.exposure.settings import Exposure
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.optics_planning import plan_optics
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.sampled_light import fit_footprint, kernel_bend_error
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

SIZE, PARTS, PITCH_UM = 48, 8, 5.0  # photosites, and parts of each per axis


def psf_of(f_number, over, sampling=None):
    lens = WavefrontPsf(Aberrations(), f_number, PITCH_UM, ((550.0,),), 1, 1)
    return FieldPsf(lens, Pupil(), sampling or Sampling(), PITCH_UM, over, (0.0,), True, (SIZE, SIZE), (1, 1))


@pytest.mark.parametrize("scale", [0.45, 0.7, 0.95])
@pytest.mark.parametrize(
    ("f_number", "over", "sampling"),
    [
        (2.8, "footprint", None),
        (8.0, "footprint", None),
        (4.0, "footprint", Sampling(1.0, 5.0)),
        (2.8, 1, None),
        (8.0, 1, None),
        (8.0, 2, None),
        (2.8, 3, None),
        (4.0, 1, Sampling(1.0, 2.5)),
        (4.0, 1, Sampling(1.0, 5.0)),
    ],
)
def test_kernels_over_samples_of_bilinear_light_keep_to_their_law(f_number, over, sampling, scale):
    """Random pixels through an Airy disk, spots and photosites by their spectra, against kernels on means over samples."""
    psf = psf_of(f_number, 1 if over == "footprint" else over, sampling)
    if over == "footprint":
        psf, over = dataclasses.replace(psf, footprints=(fit_footprint(psf, [0], scale, is_tent=True),)), 1
    pixels = np.random.default_rng(8).random((round(SIZE * scale) + 1, round(SIZE * scale) + 1))
    parts = PARTS if over == 1 else 24
    places = scale * (np.arange(SIZE * parts) + 0.5) / parts - 0.5
    light = map_coordinates(pixels, np.meshgrid(places, places, indexing="ij"), order=1, mode="nearest")
    along = np.fft.fftfreq(SIZE * parts, 1.0 / parts)
    cells, per_photosite = psf.point_cells(0, 0, 0)  # where kernels end is no error of samples
    inside = (np.arange(len(cells)) - len(cells) // 2) / per_photosite
    line = np.where(np.abs(along) <= 0.5 * per_photosite, 1.0 / np.sinc(along / per_photosite), 0.0)
    each = line[:, None] * np.exp(-2j * np.pi * np.outer(along, inside))
    lens = each @ (cells / cells.sum()) @ each.T
    spots = np.cos(np.pi * along * psf.sampling.low_pass_um / PITCH_UM)
    through = np.fft.ifft2(np.fft.fft2(light) * lens * np.outer(spots, spots)).real
    truth = through.reshape(SIZE, parts, SIZE, parts).mean(axis=(1, 3))
    if psf.footprints:
        beside = spots * psf.footprints[0].beside_transfer(along)
        light = np.fft.ifft2(np.fft.fft2(light) * np.outer(beside, beside)).real
    samples = light.reshape(SIZE, over, parts // over, SIZE, over, parts // over).mean(axis=(2, 5))
    found = np.zeros((SIZE, SIZE))
    for phase, kernel in enumerate(psf.kernel(0, 0, False, 0, 0)):
        placed, half = np.zeros((SIZE, SIZE)), len(kernel) // 2
        np.add.at(placed, tuple(np.mgrid[-half : half + 1, -half : half + 1] % SIZE), kernel)
        own = samples[:, phase // over, :, phase % over]
        found += np.fft.ifft2(np.fft.fft2(own) * np.fft.fft2(placed)).real
    bends = [np.diff(pixels, 2, axis=axis)[tuple(slice(0, pixels.shape[0] - 2) for _ in (0, 1))] for axis in (0, 1)]
    bend = np.quantile(np.hypot(*bends), 0.999)
    left = np.quantile(np.abs(found - truth)[8:-8, 8:-8], 0.999)
    stated = bend * kernel_bend_error(psf, scale, 1)
    assert 0.1 * stated < left <= stated


def test_a_lens_in_focus_samples_coarse_light_as_finely_as_its_bends_ask():
    """Detail of 0.45 pixels per photosite: means over photosites left 0.2 sigma, of which nothing was told."""
    pixels = np.random.default_rng(2).random((20, 20))
    lens = dataclasses.replace(LENS, diffraction=True)
    planned = plan(Shot(band_scene(pixels, 2.0), lens, Exposure(0.0003), small_camera(44, 44)))
    psf = planned.optics.psf
    assert psf.over == 1 and psf.footprints and psf.core is not None
    assert 0.0 < next(term.sigma for term in planned.error_budget.terms if "samples of light" in term.cause) < 0.1
    moving = plan_optics(planned.optics.scene, lens, planned.sensor, 0.1, is_at_rest=False).psf
    assert moving.over > 1 and not moving.footprints  # light that is swept first has samples of its own


@pytest.mark.parametrize("f_number", [2.8, 8.0])
def test_a_footprint_leaves_a_third_of_what_whole_photosites_leave(f_number):
    """As little as samples of a third to a quarter of a photosite do."""
    whole = psf_of(f_number, 1)
    own = dataclasses.replace(whole, footprints=(fit_footprint(whole, [0], 0.45, is_tent=True),))
    assert kernel_bend_error(own, 0.45, 1) < kernel_bend_error(whole, 0.45, 1) / 3.0


def test_kernels_of_several_distances_state_what_bends_leave():
    """The device gathers them from whole photosites."""
    depth = np.linspace(float(depth_of(0.1)), float(depth_of(0.6)), 20) + np.zeros((20, 1))
    scene = band_scene(np.random.default_rng(2).random((20, 20)), depth)
    lens = dataclasses.replace(LENS, diffraction=True, aberrations=Aberrations(spherical_um=0.1))
    planned = plan(Shot(scene, lens, Exposure(0.0003), small_camera(44, 44)))
    term = next(term for term in planned.error_budget.terms if "1 x 1 samples" in term.cause)
    assert planned.optics.psf.over == 1 and term.sigma > 0.05 and math.isfinite(term.sigma)
