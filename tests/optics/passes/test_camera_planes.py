"""Spectral integration on the device against the sum in float64."""

import numpy as np
import pytest

from simulator.optics.geometry.scene_part import ALIGNED_PX, ScenePart
from simulator.optics.passes.camera_planes import camera_planes, in_eights
from simulator.scene.scene import Layer

ROWS, COLUMNS = 5, 3 * ALIGNED_PX


def layer_and_weights(bands, channels):
    """A layer of noise and weights of all magnitudes."""
    rng = np.random.default_rng(bands)
    planes = rng.random((ROWS, COLUMNS, bands), np.float32)
    return Layer(planes, 1.0), (10.0 ** rng.uniform(-3, 3, (bands, channels))).astype(np.float32)


@pytest.mark.parametrize(("bands", "channels"), [(1, 1), (4, 3), (8, 3), (13, 3), (31, 1)])
def test_planes_are_the_weighted_sums_of_the_bands(device, bands, channels):
    layer, weights = layer_and_weights(bands, channels)
    found = device.download(camera_planes(device, layer, weights, False), (channels, ROWS, COLUMNS), np.float32)
    exact = np.einsum("yxb,bc->cyx", layer.planes.astype(np.float64), weights.astype(np.float64))
    rounding = (bands + 1) * 2.0**-24  # a product and at most all the sums, each half a unit in the last place
    np.testing.assert_array_less(np.abs(found / exact - 1.0), rounding)


@pytest.mark.parametrize("bands", [4, 13])
def test_a_part_has_the_bits_of_the_whole(device, bands):
    layer, weights = layer_and_weights(bands, 3)
    part = ScenePart(ALIGNED_PX, 1, ALIGNED_PX, 2)
    whole, cut = (
        device.download(camera_planes(device, layer, weights, False, seen), (3, ROWS, COLUMNS), np.float32)
        for seen in (None, part)
    )
    own = (slice(None), slice(1, 3), slice(ALIGNED_PX, 2 * ALIGNED_PX))
    np.testing.assert_array_equal(cut[own], whole[own])


def test_each_band_is_counted_once():
    weights = np.arange(1.0, 14.0, dtype=np.float32)[:, None]
    last = [0.0] * 3 + list(range(9, 14))
    np.testing.assert_array_equal(in_eights(weights)[:, 0], [range(1, 9), last])
