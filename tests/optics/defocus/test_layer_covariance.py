"""Two layers of one blur radius each are corrected as layers in general are."""

import dataclasses

import numpy as np
import pytest
from helpers.lens_frame import case_plan, executed_case, with_accuracy
from helpers.lens_truths import stripes

from simulator.optics.defocus.accuracy import Accuracy


@pytest.mark.parametrize("case", [stripes(-5.1, 6.0, 12.0), stripes(2.1, 3.3, 7.0, 4)], ids=lambda case: case.name)
def test_a_layer_that_covers_nothing_leaves_the_covariance_of_two_that_do(case):
    """Two layers of one radius each have a kernel of their own; three of them, or maps of radii, have one for all."""
    nothing = np.full_like(case.coverage[:1], 1e-12)
    radius_px = np.concatenate([case.radius_px[:1], case.radius_px])
    three = {"colour": np.concatenate([0.0 * nothing, case.colour]), "coverage": np.concatenate([nothing, case.coverage])}
    pair, general = (
        executed_case(one, with_accuracy(case_plan(one), Accuracy, brightest=0.0, tolerance=0.1))  # all points, as many
        for one in (case, dataclasses.replace(case, radius_px=radius_px, **three))
    )
    assert np.abs(pair - general).max() < 2e-6
