"""Fields that are computed when they are first read: once, and in copies for other processes before they leave."""

import copy
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest
from helpers.raw_frame import random_frame

from simulator.raw.raw_image import LATE, Raw


def late_frame() -> tuple[Raw, list[str]]:
    """A frame whose late fields are functions, and the names of those that were called."""
    called: list[str] = []

    def make(name: str, value: float):
        def compute() -> np.ndarray:
            called.append(name)
            return np.full((96, 128), value, np.float32)

        return compute

    def describe() -> dict[str, object]:
        called.append("resolved")
        return {"shot": {"name": "frame"}}

    late = {"mean_electrons": make("mean_electrons", 2.0), "noise_free_dn": make("noise_free_dn", 3.0), "resolved": describe}
    return random_frame(**late), called


def test_a_late_field_is_computed_once_when_it_is_read():
    raw, called = late_frame()
    assert raw.dn.shape == (96, 128) and called == []
    assert raw.noise_free_dn.max() == 3.0 and called == ["noise_free_dn"]
    assert raw.noise_free_dn is raw.noise_free_dn
    assert raw.mean_electrons.max() == 2.0 and called == ["noise_free_dn", "mean_electrons"]


def test_an_array_is_held_as_it_is_and_what_was_computed_lets_go_of_its_function():
    electrons = np.ones((96, 128), np.float32)
    assert random_frame(mean_electrons=electrons).mean_electrons is electrons
    raw, _ = late_frame()
    assert callable(vars(raw)["mean_electrons"])
    first = raw.mean_electrons
    assert vars(raw)["mean_electrons"] is first


def test_copies_hold_arrays_and_text():
    """A pickle may be read where there is no device; replaced fields leave the others."""
    for made in (lambda raw: pickle.loads(pickle.dumps(raw)), copy.deepcopy, lambda raw: replace(raw, name="other")):
        raw, called = late_frame()
        other = made(raw)
        assert sorted(called) == sorted(LATE)
        assert not any(callable(vars(other)[name]) for name in LATE)
        assert other.mean_electrons.max() == 2.0 and other.noise_free_dn.max() == 3.0
        assert other.resolved == {"shot": {"name": "frame"}}


def test_late_fields_are_fields_and_not_of_the_class():
    assert set(LATE) <= {field.name for field in fields(Raw)}
    with pytest.raises(AttributeError, match="mean_electrons"):
        _ = Raw.mean_electrons
    with pytest.raises(AttributeError):
        random_frame().mean_electrons = np.ones((96, 128), np.float32)
