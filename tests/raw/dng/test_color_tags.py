"""Colour tags as converters read them."""

import io
import shutil
import subprocess

import numpy as np
import pytest
import rawpy
from helpers.raw_frame import COLOR_MATRIX, random_frame

import simulator
from simulator.color.color_tables import CONFIGS
from simulator.errors import PhotositeError
from simulator.raw.dng.color_tags import color_tags
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes, write_dng

MATRIX_A = COLOR_MATRIX @ np.diag([1.3, 1.0, 0.6])  # of no camera; far enough from D65's to be noticed
FORWARD_A, FORWARD_D65 = np.eye(3) + 0.01, np.eye(3) - 0.02
TWO = dict(color_matrix_a=MATRIX_A, forward_matrix_a=FORWARD_A, forward_matrix_d65=FORWARD_D65)
LINEAR = dict(gamma=(1, 1), no_auto_bright=True, adjust_maximum_thr=0.0, use_camera_wb=True, output_bps=16)
ONE_MATRIX = {Tag.COLOR_MATRIX_1, Tag.AS_SHOT_NEUTRAL, Tag.CALIBRATION_ILLUMINANT_1}


def values(field) -> np.ndarray:
    assert (field.type, field.count) == (10, 9)  # SRATIONAL
    return np.divide(*np.frombuffer(field.payload, "<i4").reshape(9, 2).T).reshape(3, 3)


def test_illuminant_a_stands_first_and_d65_second():
    tags = color_tags(random_frame(**TWO))
    matrices = {
        Tag.COLOR_MATRIX_1: MATRIX_A,
        Tag.COLOR_MATRIX_2: COLOR_MATRIX,
        Tag.FORWARD_MATRIX_1: FORWARD_A,
        Tag.FORWARD_MATRIX_2: FORWARD_D65,
    }
    for code, matrix in matrices.items():
        np.testing.assert_allclose(values(tags[code]), matrix, atol=5e-7)
    lights = {Tag.CALIBRATION_ILLUMINANT_1: 17, Tag.CALIBRATION_ILLUMINANT_2: 21}  # Exif LightSource: standard light A, D65
    for code, light in lights.items():
        assert (tags[code].type, tags[code].count, tags[code].payload) == (3, 1, light.to_bytes(2, "little"))


def test_one_matrix_stands_alone_as_that_of_d65():
    tags = color_tags(random_frame())
    assert set(tags) == ONE_MATRIX and tags[Tag.CALIBRATION_ILLUMINANT_1].payload == b"\x15\0"
    np.testing.assert_allclose(values(tags[Tag.COLOR_MATRIX_1]), COLOR_MATRIX, atol=5e-7)
    assert color_tags(random_frame(cfa="MONO")) == {}


def test_a_forward_matrix_for_one_of_two_lights_is_left_out():
    # DNG 1.4: ForwardMatrix2 goes with CalibrationIlluminant2; converters blend both.
    assert not {Tag.FORWARD_MATRIX_1, Tag.FORWARD_MATRIX_2} & set(color_tags(random_frame(**TWO | {"forward_matrix_a": None})))


@pytest.mark.parametrize("name", ["color_matrix_a", "forward_matrix_a", "forward_matrix_d65"])
def test_a_matrix_that_is_no_matrix_is_refused(name):
    with pytest.raises(PhotositeError, match=r"frame: (color|forward)_matrix = .*3 x 3 finite numbers"):
        color_tags(random_frame(**TWO | {name: np.full((3, 3), np.inf)}))


def test_libraw_develops_with_the_matrix_of_d65():
    pictures, matrices = [], []
    for changes in ({}, TWO):
        with rawpy.imread(io.BytesIO(dng_bytes(random_frame(**changes)))) as frame:
            matrices.append(frame.color_matrix.copy())
            pictures.append(frame.postprocess(**LINEAR).astype(int))
    np.testing.assert_allclose(*matrices, atol=1e-6)
    np.testing.assert_allclose(*pictures, atol=1)  # of 65535: rounding


@pytest.mark.skipif(shutil.which("dcraw") is None, reason="dcraw is not installed")
def test_dcraw_develops_with_the_matrix_of_d65(tmp_path):
    pictures = []
    for name, changes in (("one", {}), ("two", TWO)):
        write_dng(random_frame(**changes), tmp_path / f"{name}.dng")
        command = ["dcraw", "-w", "-W", "-6", "-c", tmp_path / f"{name}.dng"]
        pictures.append(subprocess.run(command, capture_output=True, check=True).stdout)
    assert pictures[0] == pictures[1] and len(pictures[0]) > 1000


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
def test_a_simulated_frame_has_both_lights_and_exiftool_finds_no_fault(tmp_path):
    window = {"camera.window": {"x": 0, "y": 0, "width": 64, "height": 48}}
    raw = simulator.simulate(simulator.load_shot(CONFIGS / "shots" / "color_checker.yaml", window))
    write_dng(raw, tmp_path / "a.dng")
    done = subprocess.run(["exiftool", "-validate", "-warning", "-a", "-q", tmp_path / "a.dng"], capture_output=True, text=True)
    assert done.stdout == "Validate                        : OK\n" and done.stderr == ""
    found = subprocess.run(
        ["exiftool", "-s3", "-ForwardMatrix1", "-ForwardMatrix2", tmp_path / "a.dng"], capture_output=True, text=True
    )
    for line in found.stdout.splitlines():  # rows add up to the ICC's D50
        np.testing.assert_allclose(np.array(line.split(), float).reshape(3, 3).sum(axis=1), [0.9642, 1, 0.8249], atol=2e-6)
    assert found.stdout.count("\n") == 2


def test_a_published_matrix_stands_alone():
    shot = CONFIGS / "shots" / "flat_field.yaml"
    small = ["camera=nikon_d850", "camera.window={x: 0, y: 0, width: 64, height: 48}", "camera.color_matrix.in_dng=true"]
    assert set(color_tags(simulator.simulate(simulator.load_shot(shot, small)))) == ONE_MATRIX
