"""Measures on the device what each patch of a blurred frame holds of each layer."""

from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.defocus import CLASS_UNIT_PX, PATCH_COLUMNS, PATCH_ROWS, RadiusStatistics
from simulator.optics.geometry.projection import Projection, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.tile_grid import BlurFrame


@dataclass(frozen=True)
class Maps:
    """Radius maps of the layers that have one, one after the other on the device, and each layer's radius_statistics.

    radius: buffer (maps, 2, rows, set columns) float32 [photosites], in interleaved columns.
    scene_radius: the same of each mapped layer on the scene's grid, buffers (height, width) float32.
    """

    radius: Buffer
    scene_radius: list[Buffer]
    layer_statistics: list[RadiusStatistics]


def measured_maps(optics: OpticsPlan, device: Device, area: BlurFrame) -> Maps:
    """Radius on the photosites of every layer, and what its tiles hold."""
    defocus, layer_statistics, scene_radius = optics.defocus, [], []
    radius = device.empty(area.layout.shape(max(defocus.maps, 1)), np.float32)
    for layer, px in zip(optics.scene.layers, defocus.radii_px, strict=True):
        if np.ndim(px):
            number = len(scene_radius)
            scene_radius.append(device.upload(px))
            project_radius(device, optics.projection, scene_radius[-1], radius, number, area.layout, (area.x, area.y))
            *measured, classes = _measured(optics, device, area, radius, number)
        else:
            level, classes = np.zeros(area.patches, np.float32), np.ones(area.patches, np.uint64)
            measured = [level + np.float32(px), level + np.float32(px), level, level, level]
        filled, covered = _coverage(optics.projection, area, layer.coverage)
        layer_statistics.append(RadiusStatistics(*measured, classes, covered, filled))
    return Maps(radius, scene_radius, layer_statistics)


def _measured(optics: OpticsPlan, device: Device, area: BlurFrame, radius: Buffer, number: int) -> tuple[np.ndarray, ...]:
    """Least, greatest and steepest radius of each patch, its slopes, and its classes, of map `number`."""
    defocus = optics.defocus
    classes = {"first_class": defocus.first_class, "classes_per_unit": defocus.classes_per_unit}
    radius_statistics, present = patch_statistics(device, radius, area.rows, area.set_columns, number, **classes)
    *measured, slope_x, slope_y = radius_statistics
    rows, columns = _on_sensor(optics.sensor_px, area)
    slopes = [slope[rows[:, None], columns] for slope in (slope_x, slope_y)]
    return *measured, *slopes, present


def patch_statistics(
    device: Device, radius: Buffer, rows: int, set_columns: int, number: int, *, first_class: float, classes_per_unit: float
) -> tuple[np.ndarray, np.ndarray]:
    """Measure the patches of a radius map: (5, patch rows, patch columns) float32, and their classes as bits of uint64.

    The five: least and greatest radius, steepest step, slopes in x and y.
    radius: device buffer as kernels/radius_statistics.cl says.
    """
    patches = rows // PATCH_ROWS, 2 * set_columns // PATCH_COLUMNS
    radius_statistics, present = device.empty((5, *patches), np.float32), device.empty((2, *patches), np.uint32)
    defines = {"OVER": 1, "HALF_PATCH": PATCH_COLUMNS // 2, "PATCH_ROWS": PATCH_ROWS, "CLASS_UNIT": f"{CLASS_UNIT_PX}f"}
    device.run(
        device.kernel("radius_statistics", defines),
        patches[::-1],
        None,
        map=radius,
        radius_statistics=radius_statistics,
        present=present,
        rows=rows,
        set_columns=set_columns,
        first_plane=number,
        first_class=first_class,
        classes_per_unit=classes_per_unit,
    )
    near, far = device.download(present, (2, *patches), np.uint32).astype(np.uint64)
    return device.download(radius_statistics, (5, *patches), np.float32), near | far << np.uint64(32)


def _on_sensor(sensor_px: tuple[int, int], area: BlurFrame) -> tuple[np.ndarray, np.ndarray]:
    """For each row and column of patches the nearest that lies wholly on the sensor: beyond its edge a surface goes on."""
    width, height = sensor_px
    sides = (area.y, PATCH_ROWS, area.patches[0], height), (area.x, PATCH_COLUMNS, area.patches[1], width)
    nearest = []
    for origin, size, count, length in sides:
        first, last = -(origin // size), (length - origin) // size - 1
        nearest.append(np.clip(np.arange(count), first, max(first, min(last, count - 1))))
    return nearest[0], nearest[1]


def _coverage(projection: Projection, area: BlurFrame, coverage: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coverage of each patch, from all scene pixels that its photosites may read."""
    if coverage is None:
        return np.ones(area.patches, np.float32), np.ones(area.patches, np.float32)
    if projection.warp is not None:  # a tile's border is no straight line in the scene: what holds everywhere
        return np.full(area.patches, coverage.min(), np.float32), np.full(area.patches, coverage.max(), np.float32)
    least = greatest = coverage
    sides = (
        (0, area.y, PATCH_ROWS, area.patches[0], projection.offset_y),
        (1, area.x, PATCH_COLUMNS, area.patches[1], projection.offset_x),
    )
    for axis, origin, size, tiles, offset in sides:
        first = origin + size * np.arange(tiles)
        low, high = (np.floor(offset + projection.scale * border).astype(int) for border in (first, first + size))
        low, high = (np.clip(px, 0, coverage.shape[axis] - 1) for px in (low - 1, high + 1))
        least, greatest = (
            np.stack([ufunc.reduce(plane.take(range(a, b + 1), axis), axis) for a, b in zip(low, high, strict=True)], axis)
            for ufunc, plane in ((np.minimum, least), (np.maximum, greatest))
        )
    return least, greatest
