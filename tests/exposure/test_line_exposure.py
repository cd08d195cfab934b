"""The pass in which lines collect different shares: against NumPy, for rows, columns and one share of all."""

from typing import Literal

import numpy as np
import pytest

from simulator.exposure.exposed_light import ExposedLight, LightComponent
from simulator.exposure.light_curve import SteadyLight
from simulator.exposure.line_exposure import add_exposed_lines, expose_lines
from simulator.exposure.line_times import LineTimes
from simulator.sensor.camera.camera_sections import Window

RANDOM = np.random.default_rng(5)
WINDOW = Window(7, 3, 37, 21)
MOSAIC, LIGHT = RANDOM.random((2, 21, 37), np.float32)


def exposed_light(axis: Literal["rows", "columns", "all"], lengths: np.ndarray) -> ExposedLight:
    """Lines that are open for these times; the longest is the nominal one."""
    zero = np.zeros_like(lengths)
    lines = LineTimes(axis, zero, zero, lengths, lengths, np.ones_like(lengths))
    return ExposedLight((LightComponent(False, SteadyLight(), (lines,), 0.0, 1.0),), axis, "")


@pytest.mark.parametrize("axis", ["rows", "columns", "all"])
def test_lines_are_multiplied_by_their_shares_and_another_light_is_added_by_its_own(device, axis):
    lengths = RANDOM.random(50 if axis != "all" else 1)
    exposed = exposed_light(axis, lengths)
    (component,) = exposed.components
    whole = (lengths / lengths.max()).astype(np.float32)
    own = {"rows": whole[3:24][:, None] if axis != "all" else 0, "columns": whole[7:44], "all": np.ones(1, np.float32)}[axis]
    np.testing.assert_array_equal(np.squeeze(own), np.squeeze(exposed.window_shares(component, WINDOW)))
    mosaic = device.upload(MOSAIC.copy())
    expose_lines(device, mosaic, WINDOW, exposed, component)
    np.testing.assert_array_equal(device.download(mosaic, MOSAIC.shape, np.float32), MOSAIC * own)
    add_exposed_lines(device, mosaic, device.upload(LIGHT), WINDOW, exposed, component)
    np.testing.assert_allclose(
        device.download(mosaic, MOSAIC.shape, np.float32), (MOSAIC.astype(np.float64) + LIGHT) * own, rtol=3e-7
    )


def test_nothing_is_launched_where_all_lines_of_the_window_collect_as_much(device):
    lengths = np.where(np.arange(50) < 24, 1.0, 0.5)
    exposed = exposed_light("rows", lengths)
    mosaic = device.upload(MOSAIC)
    expose_lines(device, mosaic, WINDOW, exposed, exposed.components[0])
    np.testing.assert_array_equal(device.download(mosaic, MOSAIC.shape, np.float32), MOSAIC)
    assert exposed.varies and exposed.components[0].most == 1.0
