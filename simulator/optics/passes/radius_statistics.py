"""Measures on the device the statistics of the blur radius in each patch of a frame, layer by layer."""

from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.defocus import CLASS_UNIT_PX, PATCH_COLUMNS, PATCH_ROWS, Defocus, RadiusStatistics
from simulator.optics.geometry.projection import Projection, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.tile_grid import TileGrid


@dataclass(frozen=True)
class RadiusMaps:
    """Radius maps of the layers whose radius varies, one after the other on the device.

    radius: buffer (maps, 2, rows, set columns) float32 [photosites], in interleaved columns.
    scene_radius: the maps on the scene's grid, a buffer (height, width) float32 [photosites] each.
    """

    radius: Buffer
    scene_radius: list[Buffer]


def project_radius_maps(optics: OpticsPlan, defocus: Defocus, device: Device, area: TileGrid) -> RadiusMaps:
    """Enqueue the projection of the radius maps onto the photosites."""
    radius = device.empty(area.layout.shape(max(defocus.maps, 1)), np.float32)
    scene_radius = [device.share(np.ascontiguousarray(px)) for px in defocus.radii_px if isinstance(px, np.ndarray)]
    mapped = [place for place, px in enumerate(defocus.radii_px) if isinstance(px, np.ndarray)]
    for number, (own, place) in enumerate(zip(scene_radius, mapped, strict=True)):
        project_radius(device, optics.radius_projection, own, radius, number, area.layout, _origin(defocus, area, place))
    return RadiusMaps(radius, scene_radius)


def _origin(defocus: Defocus, area: TileGrid, layer: int) -> tuple[int, int]:
    """Photosite of the sensor, x and y, at which a layer at rest is read for the area's first sample."""
    right, down = defocus.aside_px(layer)
    return area.x + right, area.y + down


def measure_radius_maps(
    optics: OpticsPlan, defocus: Defocus, device: Device, area: TileGrid, maps: RadiusMaps
) -> list[RadiusStatistics]:
    """Measure the patches of every layer."""
    layer_statistics: list[RadiusStatistics] = []
    number = 0
    for place, (layer, px) in enumerate(zip(optics.scene.layers, defocus.radii_px, strict=True)):
        filled, covered = _coverage(optics.projection, area, _origin(defocus, area, place), layer.coverage)
        if isinstance(px, np.ndarray):
            radius_parts, classes = _measure(optics, defocus, device, area, maps.radius, number)
            number += 1
        else:
            level, classes = np.zeros(area.patches, np.float32), np.ones(area.patches, np.uint64)
            radius_parts = level + np.float32(px), level + np.float32(px), level, level, level
        least, greatest, steepest, slope_x, slope_y = radius_parts
        classes = np.where(covered > 0.0, classes, np.uint64(0))  # a layer shows no radius where it covers nothing
        layer_statistics.append(RadiusStatistics(least, greatest, steepest, slope_x, slope_y, classes, covered, filled))
    return layer_statistics


def _measure(
    optics: OpticsPlan, defocus: Defocus, device: Device, area: TileGrid, radius: Buffer, number: int
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Least and greatest radius, steepest step and slopes in x and y of each patch of map `number`; and its classes."""
    classes = {"first_class": defocus.first_class, "classes_per_unit": defocus.classes_per_unit}
    radius_statistics, present = measure_patches(device, radius, area.rows, area.set_columns, number, **classes)
    least, greatest, steepest, slope_x, slope_y = radius_statistics
    rows, columns = _on_sensor(optics.sensor_px, area)
    slope_x, slope_y = slope_x[rows[:, None], columns], slope_y[rows[:, None], columns]
    return (least, greatest, steepest, slope_x, slope_y), present


def measure_patches(
    device: Device, radius: Buffer, rows: int, set_columns: int, number: int, *, first_class: float, classes_per_unit: float
) -> tuple[np.ndarray, np.ndarray]:
    """Measure the patches of map `number`: (5, patch rows, patch columns) float32, and their classes as bits of uint64.

    The five statistics: least and greatest radius, steepest step, slopes in x and y. Units and the layout of `radius` are those
    of kernels/radius_statistics.cl.
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


def _on_sensor(sensor_px: tuple[int, int], area: TileGrid) -> tuple[np.ndarray, np.ndarray]:
    """Nearest row and column of patches on the sensor for each of the area; beyond the edge a surface keeps its slope."""
    width, height = sensor_px
    sides = (area.y, PATCH_ROWS, area.patches[0], height), (area.x, PATCH_COLUMNS, area.patches[1], width)
    nearest = []
    for origin, size, count, length in sides:
        first, last = -(origin // size), (length - origin) // size - 1
        nearest.append(np.clip(np.arange(count), first, max(first, min(last, count - 1))))
    return nearest[0], nearest[1]


def _coverage(
    projection: Projection, area: TileGrid, origin: tuple[int, int], coverage: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coverage of each patch, from all scene pixels that its photosites may read.

    origin: photosite of the sensor, x and y, at which the area's first one reads the layer.
    """
    if coverage is None:
        return np.ones(area.patches, np.float32), np.ones(area.patches, np.float32)
    if projection.is_displaced:  # a warped tile has no straight border in the scene, so the bounds of the whole layer hold
        return np.full(area.patches, coverage.min(), np.float32), np.full(area.patches, coverage.max(), np.float32)
    least = greatest = coverage
    sides = (
        (0, origin[1], PATCH_ROWS, area.patches[0], projection.offset_y),
        (1, origin[0], PATCH_COLUMNS, area.patches[1], projection.offset_x),
    )
    for axis, start, size, tiles, offset in sides:
        first = start + size * np.arange(tiles)
        low, high = (np.floor(offset + projection.scale * border).astype(int) for border in (first, first + size))
        low, high = (np.clip(px, 0, coverage.shape[axis] - 1) for px in (low - 1, high + 1))
        least, greatest = (
            np.stack([ufunc.reduce(plane.take(range(a, b + 1), axis), axis) for a, b in zip(low, high, strict=True)], axis)
            for ufunc, plane in ((np.minimum, least), (np.maximum, greatest))
        )
    return least, greatest
