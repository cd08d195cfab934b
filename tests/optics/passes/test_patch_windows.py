"""What a window of patches holds is what NumPy finds in all of its samples, also where the band ends inside a patch."""

import numpy as np
import pytest

from simulator.device import open_device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.defocus import CLASS_UNIT_PX, CLASSES, Defocus
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.passes.patch_windows import PATCH_COLUMNS, PATCH_ROWS, WINDOW_COLUMNS, WINDOW_ROWS, PatchWindows

ROWS, COLUMNS = 43, 128  # photosites
ROUNDED = 0.01  # part of a class, as in kernels/patch_windows.h


def measured_windows(layout: InterleavedColumns, defocus: Defocus, radius: np.ndarray, coverage: np.ndarray) -> np.ndarray:
    """Windows of a band of two layers, (2, patch rows, patch columns) of `struct patch_window`."""
    device, rows = open_device(), radius.shape[0]
    planes = layout.encode(np.concatenate([np.stack([light, light]) for light in coverage]))
    found = PatchWindows(device, layout, defocus, {"OVER": layout.over, "COVERAGE": 1})
    band = {"sample_rows": rows, "set_columns": layout.set_columns, "frame_x": 0, "frame_y": 0, "width": 1}
    band |= {"height": 1, "light_row": 0, "channels": 1, "cfa": 0}
    found.measure(device.upload(planes), device.upload(layout.encode(radius)), band)
    return device.download(
        found.windows, (2, found.rows, found.columns), declared_struct(kernel_source("patch_windows.h"), "patch_window")
    )


@pytest.mark.parametrize("over", [1, 2, 4])
def test_windows_hold_the_radii_and_coverages_of_their_samples(over):
    rng = np.random.default_rng(over)
    layout = InterleavedColumns(over, over * ROWS, COLUMNS // 2)
    shape = (over * ROWS, over * COLUMNS)
    radius = np.where(rng.random(shape) < 0.02, 9.0, 0.02 * np.arange(shape[1])).astype(np.float32)
    coverage = np.where(rng.random((2, *shape)) < 0.002, 0.4, 1.0).astype(np.float32)
    coverage[1, :, : shape[1] // 2] = 0.0
    defocus = Defocus((radius, 3.0), True, 1.0)
    windows = measured_windows(layout, defocus, radius, coverage)
    classes = (defocus.classes_per_unit * np.arcsinh(radius.astype(float) / CLASS_UNIT_PX) - defocus.first_class).astype(int)
    down, across = over * PATCH_ROWS, over * PATCH_COLUMNS
    for row, column in np.ndindex(windows.shape[1:]):
        held = slice(row * down, (row + WINDOW_ROWS) * down), slice(column * across, (column + WINDOW_COLUMNS) * across)
        own, constant = windows[:, row, column]
        assert own["least"] == radius[held].min() and own["greatest"] == radius[held].max()
        assert own["filled"] == coverage[0][held].min() and constant["filled"] == coverage[1][held].min()
        bits = int(own["near"]) | int(own["far"]) << 32
        assert {bit for bit in range(64) if bits >> bit & 1} == set(classes[held].ravel().tolist())
        assert bool(constant["near"] | constant["far"]) == bool((coverage[1][held] > 0.0).any())


def test_radii_a_little_beyond_the_border_of_a_class_are_in_it():
    """So that a slab that begins there needs no sample of the class before."""
    numbers = np.arange(1, CLASSES - 3)
    ends = Defocus((np.array([[-20.0, 23.0]], np.float32), 3.0), True, 1.0)
    least, after = ends.slab_borders_px[numbers], ends.slab_borders_px[numbers + 1]
    radius = np.zeros((PATCH_ROWS, PATCH_COLUMNS * CLASSES), np.float32)
    radius[:] = ends.least_px
    columns = radius[:, : PATCH_COLUMNS * len(numbers)]
    columns[:] = (least + ROUNDED * (after - least)).repeat(PATCH_COLUMNS)
    layout = InterleavedColumns(1, *np.array(radius.shape) // [1, 2])
    windows = measured_windows(layout, ends, radius, np.ones((2, *radius.shape), np.float32))[0, 0]
    held = [int(window["near"]) | int(window["far"]) << 32 for window in windows[: len(numbers) - WINDOW_COLUMNS]]
    assert held == [((1 << WINDOW_COLUMNS) - 1) << number for number in numbers[: len(held)].tolist()]
