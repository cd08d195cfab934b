"""The thin lens against its equations and worked examples."""

import math

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.lens import ThinLens


def test_lens_equation():
    lens = ThinLens(50.0, 2.0, 2.0)
    assert 1 / lens.image_distance_mm + 1 / 2000.0 == pytest.approx(1 / 50.0)
    assert lens.magnification == pytest.approx(50.0 / (2000.0 - 50.0))


def test_blur_circle_of_a_worked_example():
    """R18: 50 mm f/1.8 at 2 m, object at 4 m: diameter 0.35613 mm."""
    assert 2e-3 * ThinLens(50.0, 1.8, 2.0).blur_radius_um(4.0) == pytest.approx(0.35613, rel=1e-4)


def test_blur_is_linear_in_the_inverse_distance_and_signed():
    lens = ThinLens(50.0, 1.8, 2.0)
    radii = lens.blur_radius_um(1.0 / np.array([1.0, 0.75, 0.5, 0.25, 0.0 + 1e-300]))
    assert np.allclose(np.diff(radii), radii[1] - radii[0])
    assert radii[0] < 0 and abs(radii[2]) < 1e-9 and lens.blur_radius_um(math.inf) > 0


def test_field_of_view_and_full_frame_equivalent():
    assert ThinLens(50.0, 2.0).field_of_view_deg(36.0) == pytest.approx(39.598, abs=1e-3)  # 2 atan(18/50)
    assert ThinLens(50.0, 2.0).focal_length_35mm_mm(math.hypot(18.0, 12.0)) == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, 2.0), "lens.focal_length"),
        ((50.0, 0.4), "lens.f_number .*f/0.5"),
        ((50.0, 2.0, 0.05), "lens.focus_distance .*0.05 m"),
    ],
)
def test_impossible_lenses_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=message):
        ThinLens(*arguments)
