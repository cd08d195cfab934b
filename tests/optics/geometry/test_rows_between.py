"""Rows between a layer's own that points of aperture and time read: which, and the error that their law states."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from simulator.optics.defocus.aperture_samples import moving_samples
from simulator.optics.defocus.joint_errors import sampled_detail
from simulator.optics.defocus.scene_contrast import SceneContrast
from simulator.optics.geometry.rows_between import PHASES, rounded_rows, rows_error
from simulator.optics.pupil.pupil import Pupil

LIGHT = np.random.default_rng(5).random((72, 72))
STEEPER = sampled_detail(SceneContrast(texture=1.6), has_edges=True)  # second difference that 99 % of such pixels stay below


def test_the_nearest_place_is_read():
    places = np.random.default_rng(1).uniform(-40.0, 40.0, 1000)
    row, phase = rounded_rows(places)
    assert phase.min() == 0 and phase.max() == PHASES - 1
    assert np.abs(row + phase / PHASES - places).max() <= 0.5 / PHASES


@pytest.mark.parametrize("count", [128, 1024])
@pytest.mark.parametrize("radius_px", [0.5, 1.0, 4.0])
def test_the_law_bounds_random_pixels(radius_px, count):
    """Of a path along the rows, which leaves the spread over them to the circle."""
    samples = moving_samples(Pupil(), count, 1).astype(float)
    y, x = np.mgrid[16:56, 16:56].astype(float)
    error = np.zeros(x.shape)
    for right, below, share in samples[:, [0, 1, 5]]:
        across, down = x + radius_px * right - 12.0 * share, y + radius_px * below
        places = np.rint(PHASES * down) / PHASES
        at = [map_coordinates(LIGHT, (rows, across), order=1, mode="nearest") for rows in (places, down)]
        error += (at[0] - at[1]) / count
    found = float(np.quantile(np.abs(error), 0.999))
    assert 0.2 * rows_error(count, radius_px) < found < STEEPER * rows_error(count, radius_px)


def test_a_circle_that_is_none_errs_by_half_of_the_way_between_places():
    assert rows_error(10**9, 0.0) == pytest.approx(3.29 / 3.0 / (2.0 * PHASES), rel=1e-3)
    assert rows_error(400, 5.0) == pytest.approx(3.29 / 3.0 / (12.0**0.5 * PHASES * 20.0), rel=0.02)
