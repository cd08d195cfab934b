"""Projects a scene onto samples of light that average it over several squares (kernels/footprint_projection.cl)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.footprint import Footprint, pixel_shares
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

FILE = "footprint_projection.cl"
ANY_CFA = Cfa.uniform(0).macros(0, 0)  # of kernels that compute all channels
BAND_ROWS = 256  # photosites whose scene rows are read across at a time


class SceneGrid(Protocol):
    """Where photosites lie in the pixels of a scene, as `Projection` has it."""

    @property
    def scale(self) -> float:
        """Scene pixels per photosite."""
        ...

    @property
    def offset_x(self) -> float:
        """Scene position of the sensor's left border [px]."""
        ...

    @property
    def offset_y(self) -> float:
        """Scene position of the sensor's upper border [px]."""
        ...

    @property
    def scene_width(self) -> int:
        """Width of the scene's grid [px]."""
        ...

    @property
    def scene_height(self) -> int:
        """Height of the scene's grid [px]."""
        ...

    @property
    def is_bilinear(self) -> bool:
        """Whether light is bilinear between the middles of pixels; else these are even squares."""
        ...


@dataclass(frozen=True)
class _AcrossLines:
    """Scene rows that rows of samples read, read across at the columns of samples.

    lines: (channels, column sets, scene_rows, set columns) float32, from scene row first_row on. starts, shares: of rows of
    samples. defines: macros of the kernels.
    """

    lines: Buffer
    first_row: int
    scene_rows: int
    starts: Buffer
    shares: Buffer
    defines: dict[str, object]

    def arguments(self, projection: SceneGrid) -> dict[str, object]:
        """Arguments that the kernels which read down have in common."""
        return {
            "across": self.lines,
            "row_starts": self.starts,
            "row_shares": self.shares,
            "scene_height": projection.scene_height,
            "first_row": self.first_row,
            "scene_rows": self.scene_rows,
        }


def project_footprint(
    device: Device,
    projection: SceneGrid,
    footprints: Sequence[Footprint],
    cfa: Cfa,
    window: Window,
    planes: Buffer,
    mosaic: Buffer,
) -> None:
    """Enqueue the sharp image of one surface in each photosite's own colour. mosaic: (height, width) float32 of a window.

    footprints: of each channel.
    """
    for first in range(0, window.height, BAND_ROWS):
        rows = min(BAND_ROWS, window.height - first)
        layout = InterleavedColumns.holding(1, rows, window.width)
        band = _read_across(device, projection, footprints, planes, layout, (window.x, window.y + first), rows)
        kernel = device.kernel("footprint_mosaic", {**cfa.macros(window.x, window.y), **band.defines}, file=FILE)
        size, settings = (layout.set_columns, rows, 2), {"mosaic_row": first, "width": window.width}
        device.run(kernel, size, None, mosaic=mosaic, **settings, **band.arguments(projection))


def project_footprint_planes(
    device: Device,
    projection: SceneGrid,
    footprints: Sequence[Footprint],
    planes: Buffer,
    sampled: Buffer,
    first_plane: int,
    layout: InterleavedColumns,
    origin: tuple[int, int],
    rows: int | None = None,
) -> None:
    """Enqueue the projection of all channels onto the samples of a layout; arguments as of `project_planes`.

    footprints: of each channel.
    """
    columns, height, sets = layout.work_size(len(footprints), rows)
    band = _read_across(device, projection, footprints, planes, layout, origin, height)
    kernel = device.kernel("footprint_planes", {**ANY_CFA, **band.defines}, file=FILE)
    size, written = (columns, height, sets), {"sampled": sampled, "first_plane": first_plane, "rows": layout.rows}
    device.run(kernel, size, None, **written, **band.arguments(projection))


def _read_across(
    device: Device,
    projection: SceneGrid,
    footprints: Sequence[Footprint],
    planes: Buffer,
    layout: InterleavedColumns,
    origin: tuple[int, int],
    rows: int,
) -> _AcrossLines:
    """Enqueue the reading across for so many rows of samples from an origin on."""
    over, is_tent = layout.over, projection.is_bilinear
    places = (
        (projection.offset_x, over, over * origin[0], layout.column_sets * layout.set_columns),
        (projection.offset_y, over, over * origin[1], rows),
    )
    (columns, shares), (starts, down) = (pixel_shares(footprints, projection.scale, *axis, is_tent=is_tent) for axis in places)
    last, reads = projection.scene_height - 1, down.shape[1]
    first_row, last_row = (int(np.clip(row, 0, last)) for row in (starts[0], starts[-1] + reads - 1))
    scene_rows, sets = last_row - first_row + 1, layout.column_sets * len(footprints)
    lines, span = device.empty((sets, scene_rows, layout.set_columns), np.float32), math.gcd(device.span, layout.set_columns)
    defines: dict[str, object] = {"OVER": over, "READS": reads, "SPAN": span}
    device.run(
        device.kernel("footprint_across", {**ANY_CFA, **defines}, file=FILE),
        (layout.set_columns // span, scene_rows, sets),
        None,
        planes=planes,
        across=lines,
        column_starts=device.upload(columns),
        column_shares=device.upload(shares),
        scene_width=projection.scene_width,
        scene_height=projection.scene_height,
        first_row=first_row,
    )
    return _AcrossLines(lines, first_row, scene_rows, device.upload(starts), device.upload(down), defines)
