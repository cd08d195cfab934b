"""Diffraction of a pupil: what symmetry saves changes nothing."""

import numpy as np
import pytest

from simulator.optics.psf.fraunhofer import compute_psf


@pytest.mark.parametrize("turn", [0, 1])
@pytest.mark.parametrize("cell_um", [1.5, 8.4])  # one sample per cell, and several
def test_a_pupil_that_is_even_along_one_axis_has_the_image_of_its_whole_sum(turn, cell_um):
    """Coma and astigmatism along the field, against the same with a tilt across it by 1e-12 um, which is not even."""

    def wavefront_um(x, y, tilt_um=0.0):
        x, y = (y, x) if turn else (x, y)
        return 0.7 * (x**2 + y**2) * x + 0.3 * x**2 + tilt_um * y

    even = compute_psf(wavefront_um, 0.55, 5.6, cell_um, 31)
    whole = compute_psf(lambda x, y: wavefront_um(x, y, 1e-12), 0.55, 5.6, cell_um, 31)
    np.testing.assert_allclose(even, whole, rtol=0, atol=1e-9 * whole.max())
    mirror, other = (1, 0) if turn else (0, 1)
    np.testing.assert_allclose(even, np.flip(even, mirror), rtol=0, atol=1e-12 * even.max())
    assert np.abs(even - np.flip(even, other)).max() > 0.1 * even.max()
