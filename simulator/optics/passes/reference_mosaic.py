"""Executes the reference blur, without tolerance: traces rays through the lens for every photosite, in bands of rows."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.ray_reference.height_field_rays import sample_height_field
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.sensor.camera.camera import Window

BAND_ROWS = 64  # rows that are on the device at once; even, so that each begins with the same colours


def reference_mosaic(optics: OpticsPlan, device: Device, planes: list[Buffer], progress: Callable[[float], None]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    planes: as for `defocused_mosaic`. Rays intersect several layers, or one at a single distance, front to back
    (`lens_sampling`); one picture with depth is a surface that continues behind its edges (`lens_height_field`).
    Raises PhotositeError for layers too steep to be met once.
    """
    frame, block = optics.window, optics.cfa.block(optics.window.x, optics.window.y)
    defocus = _defocus_of(optics)
    single = len(planes) == 1 and np.ndim(defocus.radii_px[0]) > 0
    light = np.empty((frame.height, frame.width), np.float32)
    grid = Grid(optics, device, planes)
    points = ray_samples(optics.accuracy.rays, pupil=defocus.pupil)
    if grid.over == 1:
        points[..., :2] = 0.5  # samples are means over photosites: the area of the photosite counts once
    points[..., :2] = 0.5 + optics.projection.open_side * (points[..., :2] - 0.5)
    for window in _bands(frame):
        colour, coverage, radius = grid.band(window)
        if single:
            found = sample_height_field(device, colour[0], radius[0], grid.margin_px, points, window, grid.over, block)
        else:
            surfaces = upload_surfaces(device, colour, coverage, radius, grid.margin_px, grid.over)
            found = sample_lens(device, surfaces, points, window, cfa=block)
        first = window.y - frame.y
        light[first : first + window.height] = device.download(found, (window.height, window.width), np.float32)
        progress((first + window.height) / frame.height)
    return device.upload(light)


def _bands(frame: Window) -> Iterator[Window]:
    """Split a frame into windows of at most BAND_ROWS rows."""
    for first in range(0, frame.height, BAND_ROWS):
        yield Window(frame.x, frame.y + first, frame.width, min(BAND_ROWS, frame.height - first))


@dataclass
class Grid:
    """The scene's layers on `over` x `over` samples per photosite, of the scene's resolution up to 4, with a margin."""

    optics: OpticsPlan
    device: Device
    planes: list[Buffer]

    def __post_init__(self) -> None:
        defocus, scale = _defocus_of(self.optics), self.optics.projection.scale
        self.margin_px = defocus.reach_px
        self.over = 4 if scale >= 3.0 else 2 if scale >= 1.5 else 1
        self.radii = [self.device.upload(px) if isinstance(px, np.ndarray) else px for px in defocus.radii_px]

    def band(self, window: Window) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Colour (layers, channels, rows, columns), coverage and signed radius (layers, rows, columns) of a window."""
        channels, over = self.optics.channels, self.over
        size = [(side + 2 * self.margin_px) * over for side in (window.height, window.width)]
        origin, layout = (window.x - self.margin_px, window.y - self.margin_px), InterleavedColumns.holding(over, *size)
        light = np.stack([self._light(planes, layout, origin) for planes in self.planes])[..., : size[1]]
        radius = np.stack([self._radius(px, layout, origin) for px in self.radii])[..., : size[1]]
        covered = light[:, channels] if light.shape[1] > channels else np.ones_like(light[:, 0])
        return light[:, :channels], covered, radius

    def _light(self, planes: Buffer, layout: InterleavedColumns, origin: tuple[int, int]) -> np.ndarray:
        count = self.optics.channels + self.optics.has_coverage
        sampled = self.device.empty(layout.shape(count), np.float32)
        project_planes(self.device, self.optics.projection, planes, count, sampled, 0, layout, origin)
        return layout.decode(self.device.download(sampled, layout.shape(count), np.float32))

    def _radius(self, radius: Buffer | float, layout: InterleavedColumns, origin: tuple[int, int]) -> np.ndarray:
        if isinstance(radius, float | int):
            return np.full((layout.rows, layout.column_sets * layout.set_columns), radius, np.float32)
        found = self.device.empty(layout.shape(1), np.float32)
        project_radius(self.device, self.optics.projection, radius, found, 0, layout, origin)
        return layout.decode(self.device.download(found, layout.shape(1), np.float32))[0]


def _defocus_of(optics: OpticsPlan) -> Defocus:
    """The planned blur, without which this pass does not run."""
    assert optics.defocus is not None
    return optics.defocus
