"""The fused kernel as a whole: order of stages, invariance to tiles, and the same bits on every device."""

import re

import numpy as np
import pytest
from helpers.camera_builders import every_effect

from simulator.device import devices, open_device
from simulator.device.kernel_source import kernel_source
from simulator.sensor.kernel.kernel_program import stage_order
from simulator.sensor.kernel.tiles import column_edges, join_pairs
from simulator.sensor.stages.registry import FUSED

EVERYTHING = every_effect()


def picture(height=100, width=1100):
    return np.exp(np.random.default_rng(3).uniform(-3, 11, (height, width))).astype(np.float32)


def test_stages_stand_in_physical_order():
    light = ["irradiance", "exposure", "prnu", "photon_shot_noise", "dead_pixels", "dark_current", "hot_pixels", "full_well"]
    pixel = ["dsnu", "conversion_gain", "read_noise_before_gain", "random_telegraph_noise", "analog_gain"]
    column = ["column_offset", "row_noise", "banding", "read_noise_after_gain", "color_bias"]
    known = [*light, *pixel, *column, "nonlinearity", "adc", "digital_gain"]
    assert [stem for stem in stage_order() if stem in known] == known
    assert set(stage_order()) == set(FUSED)


@pytest.mark.parametrize(("width", "height"), [(64, 8), (1000, 2), (333, 32)])
def test_tile_size_changes_no_bit(bench, width, height):
    expected = bench.sensor(picture(), *EVERYTHING, gain=0.7, black=300.0)
    found = bench.like(row_px=width).sensor(picture(), *EVERYTHING, gain=0.7, black=300.0, tile_height=height)
    assert np.array_equal(found, expected)


def test_a_work_item_for_each_column_gives_the_bits_of_one_for_a_row(bench):
    """As on a GPU, whose groups have as many work-items as a row may have at most."""
    expected = bench.sensor(picture(9, 137), *EVERYTHING, y=1, few_px=0)
    assert np.array_equal(bench.like(row_px=64, span=1).sensor(picture(9, 137), *EVERYTHING, y=1), expected)


def test_a_crop_is_the_part_of_the_whole(bench):
    whole = bench.sensor(picture(), *EVERYTHING)
    assert np.array_equal(bench.sensor(picture()[41:90, 377:1001], *EVERYTHING, x=377, y=41), whole[41:90, 377:1001])


@pytest.mark.parametrize("few_px", [pytest.param(0, marks=pytest.mark.slow), 2**16])
def test_every_device_gives_the_same_bits(bench, few_px):
    """All OpenCL devices here; with one device this compares it with itself and still checks that runs repeat."""
    light = picture(48)  # few photosites, for which the first device takes no vectors
    expected = bench.sensor(light, *EVERYTHING, gain=0.7, black=300.0)
    for info in devices():
        other = type(bench)(open_device(info.label))
        assert np.array_equal(other.sensor(light, *EVERYTHING, gain=0.7, black=300.0, few_px=few_px), expected), info.label


def test_frames_of_any_size_and_place_are_covered(bench):
    """Rows go in pairs of the sensor's: frames may begin and end within one."""
    for shape in ((1, 1), (2, 3), (3, 511), (33, 513), (64, 1024)):
        for y in (0, 1):
            assert (bench.sensor(np.full(shape, 77.0), y=y) == 77).all()


@pytest.mark.parametrize("columns", [(0, 1), (3, 34), (5, 37), (6, 39), (1, 65), (0, 97), (40, 1100)])
def test_columns_left_over_by_vectors_have_the_bits_of_the_whole(bench, columns):
    whole, (first, last) = bench.sensor(picture(4, 1100), *EVERYTHING, few_px=0), columns
    for few_px in (0, 2**16):  # in vectors, and without
        part = bench.sensor(picture(4, 1100)[:, first:last], *EVERYTHING, x=first, few_px=few_px)
        assert np.array_equal(part, whole[:, first:last])


@pytest.mark.parametrize("width", [1, 31, 32, 33, 512, 1055, 1056, 1057, 4000, 8191])
@pytest.mark.parametrize(("size", "vector"), [(1024, 32), (256, 1), (16, 32), (1000, 32)])
def test_tiles_are_whole_vectors_but_for_the_last_columns(width, size, vector):
    edges = column_edges(width, size, vector)
    widths = np.diff(edges)
    assert edges[0] == 0 and edges[-1] == width and (widths > 0).all()
    assert (widths[:-1] % vector == 0).all() and (widths <= max(size, vector) + vector - 1).all()


def test_every_row_of_a_frame_is_that_of_the_whole_however_it_is_cut(bench):
    whole = bench.sensor(picture(8, 40), *EVERYTHING)
    for first in range(8):
        for last in range(first + 1, 9):
            assert np.array_equal(bench.sensor(picture(8, 40)[first:last], *EVERYTHING, y=first), whole[first:last])


def test_kernels_keep_to_plain_operators():
    """Built-in functions are opaque scalar calls on some PoCL builds, and vendor maths differs by device."""
    calls = set(re.findall(r"\b([a-z_]\w*)\s*\(", re.sub(r"//.*", "", kernel_source("sensor.cl"))))
    builtin = {
        "fma",
        "mad",
        "sqrt",
        "rsqrt",
        "exp",
        "log",
        "pow",
        "floor",
        "rint",
        "clamp",
        "fmax",
        "fmin",
        "select",
        "erfc",
        "mul_hi",
        "sin",
        "cos",
        "sinpi",
        "cospi",
        "convert_ushort_sat",
        "min",
        "max",
        "fabs",
    }
    assert not calls & builtin and not any(call.startswith("native_") for call in calls)


@pytest.mark.parametrize("count", [1, 2, 5, 6])
def test_joined_tiles_cover_each_wanted_tile_once(count):
    rng = np.random.default_rng(count)
    columns, rows = np.append(0, rng.integers(1, 5, count).cumsum()), np.array([0, 2, 6, 8, 14])
    wanted = rng.random((4, count)) < 0.6
    covered = np.zeros((14, columns[-1]), int)
    for x, y, width, height in join_pairs(columns, rows, wanted):
        covered[y : y + height, x : x + width] += 1
    assert np.array_equal(covered, wanted.astype(int).repeat(np.diff(rows), axis=0).repeat(np.diff(columns), axis=1))
