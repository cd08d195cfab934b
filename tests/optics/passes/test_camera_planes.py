"""Spectral integration: planes times weights, as NumPy's matrix product in float64."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import FixedScene

from simulator.exposure.settings import Exposure
from simulator.optics.geometry.scene_part import ALIGNED_PX, ScenePart
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.camera_planes import camera_planes, in_eights
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene

ROWS, COLUMNS = 5, 3 * ALIGNED_PX


@pytest.mark.parametrize(("bands", "cfa"), [(1, "MONO"), (3, "RGGB"), (8, "GRBG"), (31, "GRBG"), (81, "MONO")])
def test_a_sharp_mosaic_is_the_matrix_product_in_each_photosites_colour(device, bands, cfa):
    """A scene pixel for each photosite, so that nothing is mixed."""
    rng, camera = np.random.default_rng(bands), small_camera(26, 20, cfa)
    wavelengths = np.arange(400.0, 701.0, 10.0)
    scene = Scene(
        rng.random((20, 26, bands), np.float32),
        rng.random((bands, 31)),
        wavelengths,
        np.ones(31),
        math.inf,
        interpolation="nearest",
    )
    planned = plan(Shot(FixedScene(scene), ThinLens(50.0, 8.0, cos4=False), Exposure(0.01), camera))
    found = device.download(expose(measure(planned, device), device), (20, 26), np.float32)
    channel = np.array(["RGB".find(colour) for colour in cfa]).reshape(2, 2) if cfa != "MONO" else np.zeros((2, 2), int)
    weights = planned.optics.weights.T[np.tile(channel, (10, 13))].astype(np.float64)
    expected = (scene.planes.astype(np.float64) * weights).sum(axis=2)
    assert np.allclose(found, expected, rtol=(bands + 2) * 2.0**-23, atol=0)


@pytest.mark.parametrize("bands", [4, 13])
def test_a_part_has_the_bits_of_the_whole(device, bands):
    rng = np.random.default_rng(bands)
    layer, weights = Layer(rng.random((ROWS, COLUMNS, bands), np.float32), 1.0), rng.random((bands, 3), np.float32)
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
