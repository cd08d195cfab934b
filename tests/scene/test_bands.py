"""Numbers of the bands of planes, against NumPy over both axes at once."""

import numpy as np
import pytest

from simulator.scene.bands import least_of_bands, mean_of_bands, most_of_bands

PLANES = np.random.default_rng(5).normal(size=(37, 53, 4)).astype(np.float32)


@pytest.mark.parametrize("planes", [PLANES, PLANES[::2, 3:50:3], PLANES[..., :1], PLANES[:1, :1]])
def test_each_band_counts_by_itself(planes):
    assert np.array_equal(least_of_bands(planes), planes.min(axis=(0, 1)))
    assert np.array_equal(most_of_bands(planes), planes.max(axis=(0, 1)))
    assert np.allclose(mean_of_bands(planes), planes.mean(axis=(0, 1), dtype=np.float64), rtol=1e-12, atol=1e-15)
