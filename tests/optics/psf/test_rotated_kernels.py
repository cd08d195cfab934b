"""Kernels between computed ones, against the same kernels computed by wave optics."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.optics.psf.fraunhofer import ROUND, Opening
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.rotated_kernels import RotatedKernels, lagrange_weights
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil

LENS = WavefrontPsf(Aberrations(spherical_um=0.3, coma_um=0.6), 8.0, 8.0, ((500.0, 560.0),), 1)
RADIUS_PX = 1.25
SEEN = Visibility(1.0)


def exact(lens: WavefrontPsf, sampling: Sampling, made: RotatedKernels, field_xy: tuple[float, float]) -> np.ndarray:
    cells = replace(lens, size_px=made.size_px, cells=5).cell_kernel(0, RADIUS_PX, field_xy)
    return sampling.phases(cells, 5, lens.pitch_um, 1, True)[0]


@pytest.mark.parametrize("sampling", [Sampling(), Sampling(0.7, 3.0)])
@pytest.mark.parametrize("field_xy", [(0.31, 0.4), (-0.62, 0.2), (0.02, -0.05), (0.0, 0.0)])
def test_rotated_kernels_are_those_of_wave_optics(sampling, field_xy):
    """To a thousandth beside any bar and on any texture: a quarter of what shows in the noise of 2,000 e-."""
    made = RotatedKernels(LENS, sampling, (RADIUS_PX,), True, 12.0)
    found = made.kernels(field_xy)[0, 0]
    assert SEEN.error(found - exact(LENS, sampling, made, field_xy)) < 1e-3
    if field_xy != (0.0, 0.0):
        assert SEEN.error(found - exact(LENS, sampling, made, field_xy[::-1])) > 1e-2  # the place matters


@pytest.mark.parametrize(("pitch_um", "radius_px"), [(8.0, -0.75), (16.0, 0.0)])
def test_turning_does_not_bring_light_to_frequencies_that_photosites_see(pitch_um, radius_px):
    """By half a right angle, which aliases most: splines of degree three leave 1e-3, half of what shows at 2,000 e-."""
    made = RotatedKernels(replace(LENS, pitch_um=pitch_um), Sampling(), (radius_px,), True, 12.0)
    inner = slice(made.size_px // 6, made.size_px - made.size_px // 6)  # which all angles hold
    found, truth = (one((0.2, 0.2))[0, 0, inner, inner] for one in (made.kernels, made.computed_kernels))
    assert SEEN.error(found / found.sum() - truth / truth.sum()) < 2e-4
    assert abs(found.sum() - truth.sum()) < 3e-4


@pytest.mark.parametrize("field_xy", [(0.31, 0.4), (-0.62, 0.2), (0.0, 0.0)])
def test_blades_keep_to_the_picture_while_the_wavefront_turns(field_xy):
    """Seven blades at an angle, between the places and angles at which they are computed."""
    blades = Pupil(blades=7, rotation_deg=11.0)
    lens = replace(LENS, opening=Opening(blades.depth, blades.corner_radius, 7, math.radians(11.0)))
    made = RotatedKernels(lens, Sampling(), (RADIUS_PX,), True, 12.0)
    found = made.kernels(field_xy)[0, 0]
    assert SEEN.error(found - exact(lens, Sampling(), made, field_xy)) < 1e-3
    assert SEEN.error(found - exact(replace(lens, opening=ROUND), Sampling(), made, field_xy)) > 2.5e-3


def test_a_lens_that_is_the_same_all_over_is_not_rotated():
    lens = replace(LENS, aberrations=Aberrations(spherical_um=0.3, chromatic=(ChromaticShift(550.0, 20.0),)))
    made = RotatedKernels(lens, Sampling(), (RADIUS_PX,), False, 12.0)
    np.testing.assert_allclose(made.kernels((0.5, 0.1)), made.kernels((0.0, 0.0)), rtol=0, atol=0)
    assert SEEN.error(made.kernels((0.0, 0.0))[0, 0] - exact(lens, Sampling(), made, (0.0, 0.0))) < 1e-3


@pytest.mark.parametrize("nodes", [[0.0, 0.5, 1.0, 1.5, 2.5], [-1.0, 2.0]])
def test_polynomials_pass_through_the_weights(nodes):
    degree = min(len(nodes), 4) - 1
    for place in (-0.2, 0.7, 1.5, 2.1):
        numbers, weights = lagrange_weights(np.array(nodes), place)
        found = (np.array(nodes)[numbers] ** degree) @ weights
        assert found == pytest.approx(place**degree, abs=1e-12)
