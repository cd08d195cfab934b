"""What cases of the sensor share: the size of their pictures, and their inputs by name."""

import numpy as np

from simulator.sensor.camera.camera_sections import Window

from .space import Inputs, Picture

ROWS, COLUMNS = 24, 36
SHAPE = ROWS, COLUMNS
FRAME = Window(0, 0, COLUMNS, ROWS)
ANY = Picture(SHAPE)


def number(inputs: Inputs, name: str) -> float:
    """Return an input that is a number."""
    value = inputs[name]
    assert isinstance(value, float | int)
    return float(value)


def picture(inputs: Inputs, name: str = "light") -> np.ndarray:
    """Return an input that is a picture."""
    value = inputs[name]
    assert isinstance(value, np.ndarray)
    return value
