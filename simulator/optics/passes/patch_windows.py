"""Lists which radii and coverages the samples of a row band have, patch by patch, for the points of kernels/occlusion.cl."""

import math
from collections.abc import Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.defocus import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    CLASS_UNIT_PX,
    Defocus,
)
from simulator.optics.geometry.interleaved_columns import InterleavedColumns

PATCH_COLUMNS, PATCH_ROWS = 8, 4  # the least whose windows cost less than the slabs that larger ones hold in vain
# A window holds a block, and the samples to the right of it and below, wherever it begins in a patch.
WINDOW_ROWS, WINDOW_COLUMNS = BLOCK_ROWS // PATCH_ROWS + 1, BLOCK_COLUMNS // PATCH_COLUMNS + 1  # patches
TURNED_PX = math.ceil(math.hypot(BLOCK_COLUMNS, BLOCK_ROWS)) + 4  # side of what a block sees that turns


class PatchWindows:
    """Windows of patches of a band, from every patch on.

    windows: device buffer (layers, patch rows, patch columns) of `struct patch_window` of kernels/patch_windows.h.
    rows, columns: of patches that were measured last. layout: of the band's samples.
    macros: of the sizes of patches and windows, for kernels/patch_windows.h.
    defines: macros of kernels/interleaved_columns.h, and COVERAGE.
    """

    def __init__(self, device: Device, layout: InterleavedColumns, defocus: Defocus, defines: dict[str, object]) -> None:
        self._device, self._layout, self._defocus = device, layout, defocus
        rows, columns = _window_size(defocus)
        patch = {"PATCH_ROWS": PATCH_ROWS, "HALF_PATCH": PATCH_COLUMNS // 2}
        self.macros: dict[str, object] = {**patch, "WINDOW_ROWS": rows, "WINDOW_COLUMNS": columns}
        self._defines = {**defines, **self.macros, "CLASS_UNIT": f"{CLASS_UNIT_PX}f"}
        self.rows, self.columns = self._patch_rows(layout.rows), 2 * layout.set_columns // PATCH_COLUMNS
        size = (len(defocus.radii_px), self.rows, self.columns)
        window = declared_struct(kernel_source("patch_windows.h"), "patch_window")
        self._patches, self.windows = device.empty(size, window), device.empty(size, window)

    def _patch_rows(self, sample_rows: int) -> int:
        return -(-sample_rows // (self._layout.over * PATCH_ROWS))

    def measure(self, planes: Buffer, radius: Buffer, band: dict[str, int], rows: int | None = None) -> None:
        """Enqueue the measurement of the band's samples; `windows` holds them afterwards.

        planes, radius: as in kernels/occlusion.cl. band: fields of `struct row_band` of kernels/row_band.h.
        rows: of samples, a whole number of patches; None: all.
        """
        self.rows = self._patch_rows(self._layout.rows if rows is None else rows)
        content = self._device.kernel("patch_content", self._defines, file="patch_windows.cl")
        classes = {"first_class": self._defocus.first_class, "classes_per_unit": self._defocus.classes_per_unit}
        for layer, number in enumerate(map_numbers(self._defocus.radii_px)):
            buffers = {"planes": planes, "radius": radius, "patches": self._patches}
            self._device.run(
                content, (self.columns // 4, self.rows), None, **buffers, layer=layer, map=number, **classes, band=band
            )
        kernel = self._device.kernel("patch_windows", self._defines, file="patch_windows.cl")
        size = (self.columns, self.rows, len(self._defocus.radii_px))
        self._device.run(kernel, size, None, patches=self._patches, windows=self.windows)


def _window_size(defocus: Defocus) -> tuple[int, int]:
    """Return the rows and columns of patches of a window."""
    motion = defocus.motion
    points = "even" if motion is None else motion.cells(BLOCK_COLUMNS, BLOCK_ROWS).points
    if points == "rows" and defocus.accuracy.has_lamps:  # rows look up to a sample aside of the block's middle
        return WINDOW_ROWS + 1, WINDOW_COLUMNS + 1
    if points != "places":
        return WINDOW_ROWS, WINDOW_COLUMNS
    return -(-TURNED_PX // PATCH_ROWS) + 1, -(-TURNED_PX // PATCH_COLUMNS) + 1


def map_numbers(radii_px: Sequence[float | np.ndarray]) -> list[int]:
    """Number of each layer's radius map among all maps; -1 where the radius is constant."""
    varies = np.array([np.ndim(radius) > 0 for radius in radii_px])
    return np.where(varies, np.cumsum(varies) - 1, -1).tolist()
