"""Executes a lens blur without tolerance: every photosite by rays through the lens, in bands of rows."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from simulator.blur.lens_height_field import sample_height_field
from simulator.blur.lens_sampling import lens_points, sample_lens, upload_surfaces
from simulator.blur.relief import project_radius
from simulator.device import Buffer, Device
from simulator.optics_plan import OpticsPlan
from simulator.sensor.camera import Window

BAND_ROWS = 64  # rows that are on the device at once; even, so that each begins with the same colours


def reference_mosaic(optics: OpticsPlan, device: Device, planes: list[Buffer], progress: Callable[[float], None]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    planes: as for `defocused_mosaic`. Several layers, or one distance, are what rays meet front to back; one picture with its
    distances is a surface that goes on behind its edges (`lens_height_field`).
    Raises PhotositeError for layers too steep to be met once.
    """
    frame, block = optics.window, optics.cfa.block(optics.window.x, optics.window.y)
    single = len(planes) == 1 and np.ndim(optics.defocus.radii_px[0]) > 0
    light = np.empty((frame.height, frame.width), np.float32)
    grid = Grid(optics, device, planes)
    points = lens_points(optics.accuracy.rays, pupil=optics.defocus.pupil)
    if grid.over == 1:
        points[..., :2] = 0.5  # the samples are means over photosites already
    for window in _bands(frame):
        colour, coverage, radius = grid.band(window)
        if single:
            shape = (colour[0], radius[0], grid.margin_px, points, window, grid.over, block)
            found = sample_height_field(device, *shape)
        else:
            surfaces = upload_surfaces(device, colour, coverage, radius, grid.margin_px, grid.over)
            found = sample_lens(device, surfaces, points, window, cfa=block)
        first = window.y - frame.y
        light[first : first + window.height] = device.download(found, (window.height, window.width), np.float32)
        progress((first + window.height) / frame.height)
    return device.upload(light)


def _bands(frame: Window) -> Iterator[Window]:
    for first in range(0, frame.height, BAND_ROWS):
        yield Window(frame.x, frame.y + first, frame.width, min(BAND_ROWS, frame.height - first))


@dataclass
class Grid:
    """The scene's layers on `over` x `over` samples per photosite, as fine as the scene, with a margin."""

    optics: OpticsPlan
    device: Device
    planes: list[Buffer]

    def __post_init__(self):
        scale, self.margin_px = self.optics.projection.scale, self.optics.defocus.reach_px
        self.over = 4 if scale >= 3.0 else 2 if scale >= 1.5 else 1
        radii = self.optics.defocus.radii_px
        self.radii = [self.device.upload(px) if np.ndim(px) else px for px in radii]

    def band(self, window: Window) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Colour (layers, channels, rows, columns), coverage and signed radius (layers, rows, columns) of a window."""
        channels, over = self.optics.channels, self.over
        size = [(side + 2 * self.margin_px) * over for side in (window.height, window.width)]
        place = {"origin_x": window.x - self.margin_px, "origin_y": window.y - self.margin_px}
        light = np.stack([self._light(planes, place, size) for planes in self.planes])
        covered = light[:, channels] if light.shape[1] > channels else np.ones_like(light[:, 0])
        return light[:, :channels], covered, np.stack([self._radius(px, place, size) for px in self.radii])

    def _light(self, planes, place: dict, size: list[int]) -> np.ndarray:
        count, half = self.optics.channels + self.optics.has_coverage, self._half(size)
        sampled = self.device.empty((count, 2 * self.over, size[0], half), np.float32)
        kernel = self.device.kernel("projection_planes", self.optics.projection_defines(self.over), file="projection.cl")
        arguments = self.optics.projection.arguments(**place)
        work = (half, size[0], count * 2 * self.over)
        self.device.run(kernel, work, None, planes=planes, sampled=sampled, first_plane=0, **arguments)
        return self._in_rows(sampled, count, size)

    def _radius(self, radius, place: dict, size: list[int]) -> np.ndarray:
        if isinstance(radius, float):
            return np.full(size, radius, np.float32)
        shape = {"rows": size[0], "way_columns": self._half(size)}
        found = self.device.empty((1, 2 * self.over, *shape.values()), np.float32)
        project_radius(self.device, self.optics.projection, radius, found, 0, over=self.over, **place, **shape)
        return self._in_rows(found, 1, size)[0]

    def _half(self, size: list[int]) -> int:
        """Columns of each way that hold all columns (kernels/ways.h)."""
        return -(-size[1] // (2 * self.over))

    def _in_rows(self, ways, count: int, size: list[int]) -> np.ndarray:
        """Planes (count, rows, columns) from the order of kernels/ways.h."""
        split = self.device.download(ways, (count, 2 * self.over, size[0], self._half(size)), np.float32)
        return split.transpose(0, 2, 3, 1).reshape(count, size[0], -1)[..., : size[1]]
