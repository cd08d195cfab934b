"""Exact weights of even squares behind a round aperture, against the means of single squares and against sampled disks."""

import numpy as np
import pytest
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_error import z_scores

from simulator.optics.defocus.aperture_kernel import make_taps
from simulator.optics.defocus.square_kernel import disk_square_weights


@pytest.mark.parametrize(("radius_px", "samples"), [(0.01, 1), (0.3, 2), (1.5, 2), (2.2, 4), (8.02, 2)])
@pytest.mark.parametrize("open_side", [pytest.param(1.0, marks=pytest.mark.slow), 0.7])
def test_weights_are_those_of_single_squares(radius_px, samples, open_side):
    """A photosite amid black squares but for one sees the weight of that one; even light stays even."""
    weights = disk_square_weights(radius_px, samples, open_side)
    side = len(weights)
    photosites = 2 * (side // samples // 2) + 3  # odd: one in the middle
    first = (samples * photosites - side) // 2
    assert weights.sum() == pytest.approx(1.0) and np.allclose(weights, weights.T) and np.allclose(weights, weights[::-1])
    for row, column in ((side // 2, side // 2), (side // 2, 0), (side // 3, side // 4), (side - 1, side // 2)):
        scene = np.zeros((samples * photosites,) * 2)
        scene[first + row, first + column] = 1.0
        means = photosite_means(scene, (photosites,) * 2, radius_px, open_side**2, chords=2048)
        assert weights[row, column] == pytest.approx(means[photosites // 2, photosites // 2], abs=1e-4 * weights.max())


def test_squares_inside_the_disk_are_equal_so_that_few_sums_are_read():
    weights = disk_square_weights(8.02, 2)
    assert len(make_taps([weights], 2)[0].rows) < 0.5 * weights.size and len(np.unique(weights[12:24, 12:24])) == 1


@pytest.mark.parametrize("radius_px", [1.5, 8.02])
def test_the_rim_of_a_bright_light_over_black_is_sharp(radius_px):
    """A lamp of 10^6 squares of light of 1 e-, and the end of a bright field: parts of squares left 6 and 9 sigma."""
    scene = np.ones((64, 80))
    scene[33, 41] = 4e6
    scene[:, :8] = 1e5
    found, _ = frame_radiance(fine_shot(scene, (32, 40), radius_px, 1.0))
    truth = photosite_means(scene.astype(np.float32).astype(float), (32, 40), radius_px, chords=4096)
    assert np.abs(z_scores(found, truth, 1.0))[10:-10, 10:-10].max() < 0.1
