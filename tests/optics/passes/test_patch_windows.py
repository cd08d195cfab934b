"""What a window of patches holds is what NumPy finds in all of its samples, also where the band ends inside a patch."""

import numpy as np
import pytest

from simulator.device import open_device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.defocus import CLASS_UNIT_PX, Defocus
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.passes.patch_windows import WINDOW_COLUMNS, WINDOW_ROWS, PatchWindows
from simulator.sensor.camera.cfa import Cfa

ROWS, COLUMNS = 43, 128  # photosites
PATCH = 8  # photosites per side


@pytest.mark.parametrize("over", [1, 2, 4])
def test_windows_hold_the_radii_and_coverages_of_their_samples(over):
    rng, device = np.random.default_rng(over), open_device()
    layout = InterleavedColumns(over, over * ROWS, COLUMNS // 2)
    shape = (over * ROWS, over * COLUMNS)
    radius = np.where(rng.random(shape) < 0.02, 9.0, 0.02 * np.arange(shape[1])).astype(np.float32)
    coverage = np.where(rng.random((2, *shape)) < 0.002, 0.4, 1.0).astype(np.float32)
    coverage[1, :, : shape[1] // 2] = 0.0
    planes = layout.encode(np.concatenate([np.stack([light, light]) for light in coverage]))
    defocus = Defocus((radius, 3.0), True, 1.0)
    defines = {**Cfa.uniform(0).macros(0, 0), "OVER": over, "CHANNELS": 1, "COVERAGE": 1}
    found = PatchWindows(device, layout, defocus, defines)
    band = {"sample_rows": layout.rows, "set_columns": layout.set_columns, "frame_x": 0, "frame_y": 0, "width": 1}
    band |= {"height": 1, "light_row": 0}
    found.measure(device.upload(planes), device.upload(layout.encode(radius)), band)
    windows = device.download(
        found.windows, (2, found.rows, found.columns), declared_struct(kernel_source("patch_windows.h"), "patch_window")
    )
    classes = (defocus.classes_per_unit * np.arcsinh(radius.astype(float) / CLASS_UNIT_PX) - defocus.first_class).astype(int)
    side = over * PATCH
    for row, column in np.ndindex(found.rows, found.columns):
        held = slice(row * side, (row + WINDOW_ROWS) * side), slice(column * side, (column + WINDOW_COLUMNS) * side)
        own, constant = windows[:, row, column]
        assert own["least"] == radius[held].min() and own["greatest"] == radius[held].max()
        assert own["filled"] == coverage[0][held].min() and constant["filled"] == coverage[1][held].min()
        bits = int(own["near"]) | int(own["far"]) << 32
        assert {bit for bit in range(64) if bits >> bit & 1} == set(classes[held].ravel().tolist())
        assert bool(constant["near"] | constant["far"]) == bool((coverage[1][held] > 0.0).any())
