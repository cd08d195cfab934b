"""Spectral integration: planes times weights, as NumPy's matrix product in float64."""

import numpy as np
import pytest


@pytest.mark.parametrize(("bands", "channels"), [(1, 1), (3, 3), (31, 3), (81, 1)])
def test_planes_are_the_matrix_product(device, bands, channels):
    rng = np.random.default_rng(bands)
    scene, weights = rng.random((500, bands), np.float32), rng.random((bands, channels), np.float32)
    planes = device.empty((channels, 500), np.float32)
    kernel = device.kernel("camera_planes", {"BANDS": bands, "CHANNELS": channels})
    device.run(kernel, (500, channels), None, scene=device.upload(scene), weights=device.upload(weights), planes=planes)
    expected = (scene.astype(np.float64) @ weights.astype(np.float64)).T
    assert np.allclose(device.download(planes, (channels, 500), np.float32), expected, rtol=bands * 2.0**-23, atol=0)
