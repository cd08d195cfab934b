"""The area of a photosite on a grid of samples."""

import numpy as np
import pytest
from scipy.signal import convolve2d

from simulator.optics.defocus.photosite_area import PhotositeArea


@pytest.mark.parametrize("open_side", [1.0, 0.7])
@pytest.mark.parametrize("samples_per_axis", [1, 4, 9])
def test_the_mean_over_a_photosite_is_a_convolution_with_its_open_square(open_side, samples_per_axis):
    area, images = PhotositeArea(fine=True, open_side=open_side), np.random.default_rng(1).random((2, 7, 7))
    shares = area.shares(samples_per_axis)
    truth = [convolve2d(image, np.outer(shares, shares)) for image in images]
    np.testing.assert_allclose(area.mean(images, samples_per_axis), truth, rtol=1e-13)
    assert shares.sum() == pytest.approx(1.0)
