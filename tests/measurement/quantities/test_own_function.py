"""A user's own function is found by its name, and whatever goes wrong in it is one message."""

import math

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.measurement.quantities import MeasuredFrame, OwnFunction

MODULE = """
import numpy as np
from simulator.measurement.quantities import Curve, Figure, Measured

def mean(frame): return frame.dn.mean()
def two(frame):
    row = Curve(np.arange(2.0), np.ones(2), "x", "", "y", "DN")
    return {"low": frame.dn.min(), "high": Figure(7.0, "DN", 0.5), "row": row}
def whole(frame): return Measured({"a": Figure(1.0, "m")})
def text(frame): return "much"
def fails(frame): return 1 / 0
number = 5
"""


@pytest.fixture
def frame(tmp_path, monkeypatch):
    (tmp_path / "photosite_own_quantities.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    return MeasuredFrame(np.arange(256, dtype=np.uint16).reshape(16, 16), "MONO", np.zeros((2, 2)), 4095, name="a.dng")


def measure(frame, name):
    return OwnFunction(f"photosite_own_quantities.{name}").measure(frame)


def test_a_function_in_the_current_folder_gives_a_number_or_more(frame):
    assert measure(frame, "mean").figures["value"].value == 127.5
    found = measure(frame, "two")
    assert (found.figures["low"].value, found.figures["high"].sigma) == (0.0, 0.5) and found.curves["row"].y_unit == "DN"
    assert measure(frame, "whole").figures["a"].unit == "m"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("text", r"python = .*\.text: returned str as value; return a number"),
        ("fails", r"a\.dng: python = .*\.fails: raised ZeroDivisionError: division by zero"),
        ("none", r"has no function none; check the name"),
        ("number", r"has no function number"),
    ],
)
def test_what_a_function_does_wrong_is_told(frame, name, message):
    with pytest.raises(PhotositeError, match=message):
        measure(frame, name)


def test_a_module_that_is_not_there_and_a_name_that_is_none_are_told(frame):
    with pytest.raises(PhotositeError, match="module no_such_module cannot be imported .* start photosite in its folder"):
        OwnFunction("no_such_module.f").measure(frame)
    with pytest.raises(PhotositeError, match="python = f: give module.function"):
        OwnFunction("f")
    assert not math.isnan(measure(frame, "mean").figures["value"].value)
