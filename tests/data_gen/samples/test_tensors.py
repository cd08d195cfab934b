"""Samples as tensors: what is divided by what, in which order, and how to come back to codes."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.toy_samples import toy_sample

from data_gen.samples.tensors import TensorForm
from simulator.errors import PhotositeError

ROOT = Path(__file__).parents[3]
BLACK_DN, SPAN_DN = 512.0, 16383.0 - 512.0


@pytest.mark.parametrize("amplify", [False, True])
@pytest.mark.parametrize(("mode", "frames"), [("single", 1), ("burst", 3), ("multi_exposure", 2)])
def test_codes_come_back_from_tensors_by_the_numbers_beside_them(mode, frames, amplify):
    sample = toy_sample(4, frames=frames, mode=mode)
    found = TensorForm("mosaic", amplify).of(sample)
    lead = () if mode == "single" else (frames,)
    assert found["noisy"].shape == found["clean"].shape == found["variance"].shape == (*lead, 1, 24, 32)
    unit = found["noisy_unit_dn"][..., None, None, None]
    noisy = np.rint(found["noisy"] * unit + found["black_level_dn"]).reshape(frames, 24, 32)
    assert np.array_equal(noisy, sample.noisy_dn) and noisy.min() == 0
    clean = found["clean"] * found["clean_unit_dn"] + found["black_level_dn"]
    assert np.abs(clean.reshape(frames, 24, 32) - sample.clean_dn).max() < 2e-3
    assert np.allclose((found["variance"] * unit**2).reshape(frames, 24, 32), sample.variance_dn2, rtol=1e-6)
    assert ("offsets_px" in found) == (mode == "burst")


def test_black_is_0_and_white_is_1_and_a_frame_of_less_light_is_as_bright_when_amplified():
    clean = np.full((1, 4, 4), BLACK_DN, np.float32)
    clean[0, 0, 0] = 16383
    noisy = np.full((1, 4, 4), 512, np.uint16)
    noisy[0, 0, 0] = 512 + 1587  # a tenth of the span of 15871, rounded
    sample = toy_sample(0, clean_dn=clean, noisy_dn=noisy, variance_dn2=None, exposure_ratios=(10.0,))
    found, plain = TensorForm("mosaic").of(sample), TensorForm("mosaic", amplify=False).of(sample)
    assert found["clean"][0, 0, 0] == 1.0 and found["clean"][0, 1, 1] == 0.0 and "variance" not in found
    assert found["noisy"][0, 0, 0] == pytest.approx(10 * 1587 / SPAN_DN) and found["noisy"][0, 1, 1] == 0.0
    assert plain["noisy"][0, 0, 0] == pytest.approx(1587 / SPAN_DN)
    assert found["gain"] == pytest.approx(10 * sample.gain_dn_per_e / SPAN_DN)
    assert plain["read_noise"] == pytest.approx(3.0 / SPAN_DN) and found["ratio"] == plain["ratio"] == 10.0


@pytest.mark.parametrize(("channels", "letters"), [("rggb", "RGGB"), ("rgbg", "RGBG")])
@pytest.mark.parametrize("cfa", ["RGGB", "BGGR", "GRBG", "GBRG"])
def test_planes_stand_in_the_order_that_is_named(cfa, channels, letters):
    colours = np.tile(np.array(["RGB".index(letter) for letter in cfa], np.uint16).reshape(2, 2), (3, 4))[np.newaxis]
    sample = toy_sample(
        1, cfa=cfa, noisy_dn=colours, clean_dn=colours.astype(np.float32), black_level_dn=0.0, variance_dn2=None
    )
    found = TensorForm(channels, amplify=False).of(sample)
    planes = np.rint(found["noisy"] * found["noisy_unit_dn"])
    assert planes.shape == (4, 3, 4)
    assert [set(plane.ravel().tolist()) for plane in planes] == [{"RGB".index(letter)} for letter in letters]


def test_what_is_not_known_is_nan_and_types_are_those_of_networks():
    found = TensorForm().of(toy_sample(2, color_matrix=None))
    assert np.isnan(found["color_matrix"]).all() and found["color_matrix"].shape == (3, 3)
    kinds = {name: value if isinstance(value, str) else str(value.dtype) for name, value in found.items()}
    words = {kinds.pop("camera"), kinds.pop("cfa"), kinds.pop("source")}
    assert words == {"sony_a7s2", "RGGB", "ramp/0002.png"}
    assert {kinds.pop("index"), kinds.pop("iso")} == {"int64"} and set(kinds.values()) == {"float32"}


def test_an_unknown_order_is_refused():
    with pytest.raises(PhotositeError, match="channels = bggr: give one of mosaic, rggb, rgbg"):
        TensorForm("bggr")


def test_without_pytorch_the_module_says_what_to_install_and_nothing_else_needs_it():
    program = """
import sys
sys.modules["torch"] = None  # as if it were not installed
import data_gen.recipe.dataset_config, data_gen.command_line, data_gen.dataset_command, data_gen.samples.tensors
try:
    import data_gen.torch
except ImportError as error:
    print(error)
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "data_gen.torch needs PyTorch 2.4 or newer: pip install 'photosite[torch]'\n"
