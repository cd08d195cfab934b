"""Samples of a scene of one pixel per photosite that nothing displaces are its pixels."""

import dataclasses

import numpy as np
import pytest

from simulator.device import open_device
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project_planes


@pytest.mark.parametrize("origin", [(-40, -7), (3, 11), (90, 60)])
def test_planes_of_a_pixel_per_photosite_hold_its_pixels(origin):
    """Beyond the scene's edges those at its edge; rows that are not asked for are left alone."""
    device, (height, width), written = open_device(), (50, 150), 33
    scene = np.random.default_rng(3).random((2, height, width), np.float32)
    projection, layout = Projection(1.0, 2.0, -1.0, width, height, 1, False), InterleavedColumns(1, 40, 96)
    assert projection.copies_pixels(1) and not dataclasses.replace(projection, offset_x=2.25).copies_pixels(1)
    sampled = device.upload(np.full(layout.shape(3), 7.0, np.float32))
    project_planes(device, projection, device.upload(scene), 2, sampled, 1, layout, origin, written)
    found = layout.decode(device.download(sampled, layout.shape(3), np.float32))
    rows = np.clip(origin[1] - 1 + np.arange(written), 0, height - 1)
    columns = np.clip(origin[0] + 2 + np.arange(192), 0, width - 1)
    assert np.array_equal(found[1:, :written], scene[:, rows[:, None], columns])
    assert (found[0] == 7.0).all() and (found[:, written:] == 7.0).all()
