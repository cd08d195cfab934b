"""Photosites that gather with the kernels of their own blur radius, against exact kernels in float64."""

import dataclasses

import numpy as np
from helpers.aberrated_walls import SPHERICAL, depth_at, thin_lens
from helpers.kernels_alone import electrons_by_kernels
from helpers.lens_error import statistics, z_scores
from helpers.psf_frames import BRIGHTEST_E, MARGIN, SIDE, contrasts, shot_of

from simulator.optics.psf.field_psf import FieldPsf
from simulator.pipeline.planner import plan


def test_radii_between_the_slabs_have_their_own_kernels():
    """A wall that recedes: each photosite has the kernel of its own blur radius, in float64.

    To 0.2 of the noise of 2,000 e-: a receding wall has wider kernels on its far side, which no photosite's own kernel has.
    """
    planes, through = contrasts(), thin_lens(8.0, SPHERICAL)
    radius_px = np.linspace(1.0, 1.8, SIDE)
    shot = shot_of(planes, through, np.broadcast_to(depth_at(through, radius_px), (SIDE, SIDE)).astype(np.float32))
    psf, found = plan(shot).optics.psf, electrons_by_kernels(shot)
    columns = range(20, SIDE - 16, 24)
    truth = np.stack([column_of(planes, psf, float(radius_px[column]), column) for column in columns], axis=1)
    scale = found[:, columns].sum() / truth.sum() / BRIGHTEST_E
    assert statistics(z_scores(found[:, columns] / (scale * BRIGHTEST_E), truth, BRIGHTEST_E)).p99 < 0.2


def column_of(planes: np.ndarray, psf: FieldPsf, radius_px: float, column: int) -> np.ndarray:
    """Light of one column of photosites with the kernel of a blur radius, float64."""
    kernel = dataclasses.replace(psf, radii_px=(radius_px,), core=None).kernel(0, 0, False, 0, 0)[0][::-1, ::-1]
    half, x = len(kernel) // 2, column + MARGIN
    lit = np.pad(planes, MARGIN, mode="edge")[:, x - half : x + half + 1]
    near = np.lib.stride_tricks.sliding_window_view(lit, kernel.shape)[:, 0]
    return np.maximum((near * kernel).sum(axis=(1, 2))[MARGIN - half : MARGIN - half + SIDE], 0.0)
