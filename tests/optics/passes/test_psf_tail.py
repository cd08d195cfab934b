"""The wide part of a kernel on cells of several photosites: with the core it is the exact kernel."""

import math

from helpers.green_frames import lens
from helpers.psf_frames import contrasts, error, shot_of

from simulator.pipeline.planner import plan


def test_a_tail_on_cells_is_the_rest_of_the_kernel():
    planes = contrasts()
    shot = shot_of(planes, lens(22.0, diffraction=True), math.inf)
    psf = plan(shot).optics.psf
    assert psf.core.has_tail and psf.core.reach_px < psf.reach_px
    assert error(shot, planes, psf.kernel(0, 0, False, 0, 0).sum(axis=0)) < 0.1
