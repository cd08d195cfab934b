"""Point spread functions gathered on the device: against SciPy's convolution with the exact kernel in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.green_frames import PITCH_UM, lens
from helpers.kernels_alone import electrons_by_kernels
from helpers.lens_error import statistics, z_scores
from helpers.psf_frames import BRIGHTEST_E, SIDE, contrasts, error, shot_of
from scipy.signal import fftconvolve

from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.psf_cost import gathered_samples
from simulator.pipeline.planner import measure, plan

LENSES = {
    "f/8": (lens(8.0, diffraction=True), {}),
    "f/1.4": (lens(1.4, diffraction=True), {}),
    "spherical": (lens(5.6, aberrations=Aberrations(spherical_um=0.4)), {}),
    "all": (lens(8.0, diffraction=True), {"low_pass_um": 2.4, "fill_factor": 0.6}),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name == "spherical" else []) for name in LENSES]
)
def test_light_is_convolved_with_the_exact_kernel_to_a_tenth_of_the_noise(name):
    through, settings = LENSES[name]
    planes = contrasts()
    shot = shot_of(planes, through, math.inf, **settings)
    planned = plan(shot)
    psf = planned.optics.psf
    assert psf.core is not None and planned.error_budget.predicted_sigma < planned.optics.tolerance
    assert error(shot, planes, psf.kernel(0, 0, False, 0, 0).sum(axis=0)) < 0.1


@pytest.mark.parametrize(
    ("f_number", "radius_px", "tolerance"),
    [
        (8.0, 0.7, 0.1),
        pytest.param(8.0, 0.85, 0.1, marks=pytest.mark.slow),
        (8.0, 2.2, 0.1),
        pytest.param(8.0, -3.0, 0.1, marks=pytest.mark.slow),
        pytest.param(8.0, -7.3, 0.1, marks=pytest.mark.slow),
        (2.0, 1.6, 0.1),
        (22.0, 2.2, 0.003),  # no core is small enough: the host transforms the light, and the device adds the corrections
    ],
)
def test_a_geometric_blur_is_corrected_to_wave_optics(f_number, radius_px, tolerance):
    """A wall of which half is out of focus, with light between 0.4 and 1: the kernel of wave optics, away from the step.

    What is left is the interpolation between the radii of the blur and of its corrections, and what they cut off.
    """
    planes = 0.4 + 0.6 * contrasts()
    through = ThinLens(50.0, f_number, 2.0, cos4=False, diffraction=True)
    per_dioptre = float(through.blur_radius_um(math.inf) - through.blur_radius_um(1.0)) / PITCH_UM
    depth = np.full((SIDE, SIDE), 2.0, np.float32)
    depth[:, : SIDE // 2] = 1.0 / (0.5 - radius_px / per_dioptre)
    shot = dataclasses.replace(shot_of(planes, through, depth), tolerance=tolerance)
    psf = plan(shot).optics.psf
    assert psf.corrected_px and not psf.by_distance and (psf.core is None) == (tolerance < 0.01)
    exact = psf.at_radius(radius_px).kernel(0, 0, False, 0, 0)[0]
    apart = 24 + round(4.0 * abs(radius_px))  # nearer, rays through points of the aperture make the blur
    left, right = slice(0, SIDE // 2 - apart), slice(SIDE // 2 + apart, SIDE)
    assert error(shot, planes, exact, (slice(None), left)) < 0.1
    assert error(shot, planes, psf.at_radius(0.0).kernel(0, 0, False, 0, 0)[0], (slice(None), right)) < 0.1


def test_beyond_the_corrections_the_blur_of_an_ideal_lens_is_spread_by_the_kernel_in_focus(device):
    """A wall that tilts out of focus: radii of the blur are tabulated coarsely where no correction relies on them."""
    planes = 0.4 + 0.6 * contrasts()
    through = ThinLens(50.0, 2.0, 2.0, cos4=False, diffraction=True)
    per_dioptre = float(through.blur_radius_um(math.inf) - through.blur_radius_um(1.0)) / PITCH_UM
    depth = np.tile(1.0 / (0.5 - 0.075 * np.arange(SIDE)[:, None] / per_dioptre), SIDE).astype(np.float32)
    shot = shot_of(planes, through, depth)
    planned = measure(plan(shot), device)
    coarse = planned.tiles.chosen.coarse
    assert 4.0 < planned.tiles.defocus.corrected_px < 6.0
    assert coarse.any() and not coarse.all()
    own = planned.optics.accuracy.tolerance  # of the blur, so that both round slopes to the same steps
    ideal = dataclasses.replace(shot, lens=dataclasses.replace(through, diffraction=False), tolerance=own)
    blurred, found = (electrons_by_kernels(one) for one in (ideal, shot))
    truth = fftconvolve(blurred, planned.optics.psf.kernel(0, 0, False, 0, 0)[0], mode="same")
    shown = slice(88, SIDE - 32), slice(32, SIDE - 32)
    assert statistics(z_scores(found[shown] / BRIGHTEST_E, truth[shown] / BRIGHTEST_E, BRIGHTEST_E)).p99_9 < 0.1


def test_smooth_light_takes_fewer_samples_to_a_tenth_of_the_noise():
    """Five photosites to a pixel of random light, 1.2:1, against the exact kernel in float64; even squares are not smooth."""
    coarse = 0.85 + 0.15 * np.random.default_rng(4).random((SIDE // 5, SIDE // 5))
    samples = {}
    for interpolation in ("bilinear", "nearest"):
        sharp, shot = (shot_of(coarse, lens(8.0, diffraction=one), math.inf, interpolation) for one in (False, True))
        psf = plan(shot).optics.psf
        samples[interpolation] = gathered_samples(psf)
        assert psf.over == 1
        light, found = (electrons_by_kernels(one) for one in (sharp, shot))
        if psf.footprints:  # the samples of such light have less of its waves
            taken = psf.footprints[0].beside_transfer(np.fft.fftfreq(SIDE))
            light = np.fft.ifft2(np.fft.fft2(light) * np.outer(taken, taken)).real
        truth = fftconvolve(light, psf.kernel(0, 0, False, 0, 0)[0], mode="same")
        shown = slice(32, SIDE - 32), slice(32, SIDE - 32)
        assert statistics(z_scores(found[shown] / BRIGHTEST_E, truth[shown] / BRIGHTEST_E, BRIGHTEST_E)).p99_9 < 0.1
    assert samples["bilinear"] < 0.75 * samples["nearest"]
