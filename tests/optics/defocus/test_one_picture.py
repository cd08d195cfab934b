"""The blur of one picture with depth, whose hidden background is not there, against rays through the true layers."""

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import blurred_case
from helpers.textured_planes import one_picture, textured_planes, with_truth_of_rays

from simulator.device import open_device


@pytest.mark.parametrize(("radii_px", "share"), [((-12.0, -4.0, 6.0), 0.9), ((-8.0, 0.0, 8.0), 0.9), ((0.0, 6.0, 14.0), 1.0)])
def test_a_background_that_is_extended_brings_the_picture_nearer_to_that_of_layers(radii_px, share):
    """Textures behind edges: the mean of what lies beside an edge is nearer to what it hides than nothing is."""
    case = with_truth_of_rays(textured_planes(radii_px), open_device())
    flat = one_picture(case)
    none, extended = (statistics(z_scores(blurred_case(flat, hidden=kind), case.truth, 2000.0)) for kind in ("none", "extend"))
    assert extended.p99 < share * none.p99 and extended.rms < share * none.rms
    layers = statistics(z_scores(blurred_case(case), case.truth, 2000.0))
    assert layers.p99 < 0.1 * extended.p99  # what is left is the guess, not the blur


def test_before_a_uniform_wall_the_extended_background_is_the_true_one():
    """A textured disk before a wall of one colour: nothing has to be guessed that the picture does not show."""
    case = textured_planes((-10.0, -10.0, 3.0))
    case.colour[2], case.colour[1], case.coverage[1] = 0.8, 0.0, 0.0
    case = with_truth_of_rays(case, open_device())
    flat = one_picture(case)
    none, extended = (z_scores(blurred_case(flat, hidden=kind), case.truth, 2000.0) for kind in ("none", "extend"))
    assert np.quantile(np.abs(none), 0.99) > 1.0
    assert np.quantile(np.abs(extended), 0.99) < 0.3 and abs(extended.mean()) < 0.02
