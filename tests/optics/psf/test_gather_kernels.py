"""Kernels as the device holds them: folded where halves mirror each other."""

import numpy as np
import pytest

from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.gather_kernels import GatherKernels, choose_core
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.visibility import Visibility
from simulator.optics.pupil.pupil import Pupil


def unfolded(kernels: GatherKernels) -> np.ndarray:
    """Weight that each sample gets: where the kernel reads it itself, and where it reads its mirror image."""
    found = np.zeros((*kernels.core.shape[:-2], *kernels.taps))
    down, across = kernels.core.shape[-2:]
    for mirror_y in range(1 + kernels.folded[0]):
        for mirror_x in range(1 + kernels.folded[1]):
            part = found[..., ::-1, :] if mirror_y else found
            part = part[..., ::-1] if mirror_x else part
            part[..., :down, :across] += kernels.core
    return found


def mirrored(rng: np.random.Generator, down: int, across: int, axes: tuple[int, ...]) -> np.ndarray:
    """A core whose halves mirror each other along some axes."""
    core = rng.normal(size=(2, 3, 1, 2, 3, down, across))
    for axis in axes:
        core = core + np.flip(core, axis)
    return core


@pytest.mark.parametrize(("down", "across"), [(7, 7), (6, 6), (1, 9), (9, 1)])
@pytest.mark.parametrize("axes", [(), (-2,), (-1,), (-2, -1)])
def test_a_folded_kernel_gives_each_sample_its_weight(down, across, axes):
    core = mirrored(np.random.default_rng(0), down, across, axes)
    kernels = GatherKernels.of((0.0, 1.0, 2.0), core, 1, False)
    assert kernels.taps == (down, across)
    assert kernels.folded == (-2 in axes and down > 1, -1 in axes and across > 1)
    np.testing.assert_allclose(unfolded(kernels), core, atol=1e-6)


def test_kernels_of_zeros_are_not_kept():
    core = np.ones((2, 3, 1, 1, 1, 3, 3))
    core[:, 1] = 0.0
    assert GatherKernels.of((0.0, 1.0, 2.0), core, 1, False).kept.tolist() == [True, False, True]


def psf_of_spot(reach_px: int, width_px: float) -> FieldPsf:
    """PSF of a file: a spot with wings."""
    y, x = np.mgrid[-reach_px : reach_px + 1, -reach_px : reach_px + 1]
    spot = np.exp(-0.5 * (x**2 + y**2) / width_px**2) + 1e-7
    table = PsfTable((spot / spot.sum())[None, None, None], np.zeros(1), np.zeros(1), 1, 5.0)
    return FieldPsf(table, Pupil(), Sampling(), 5.0, 1, (0.0,), True, (64, 48), (1, 1))


@pytest.mark.parametrize(("reach_px", "width_px", "taken_px"), [(8, 1.8, 8), (24, 3.0, 11)])
def test_a_core_leaves_light_out_where_that_spares_time(reach_px, width_px, taken_px):
    """What is left out of a small kernel costs SciPy, which leaves nothing out, no more time."""
    core = choose_core(psf_of_spot(reach_px, width_px), 1, Visibility(2e-3))
    assert core is not None and core.reach_px == taken_px and (core.error == 0.0) == (taken_px == reach_px)
