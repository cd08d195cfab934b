"""The lens blur of small circles in a scene finer than the photosites: tiles that are gathered from the scene's pixels."""

import itertools
import math

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.accuracy import LAMP_PEAK
from simulator.optics.defocus.aperture_rectangles import aperture_rectangles, rectangle_count
from simulator.optics.defocus.defocus import TILE_COLUMNS, TILE_ROWS
from simulator.optics.defocus.scene_light import brighter_pixels
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.content_keys import freeze
from simulator.scene.scene import Scene
from simulator.sensor.camera.cfa import Cfa

SPAN = 16  # photosites of a work-item on a CPU
MOST_PX = 3.0  # larger blur circles reach more pixels than are gathered (`MOST_GATHERED`) [photosites]
RADIUS_STEP_PX = 0.25  # tiles whose blur circles lie between multiples of it share a launch


def gather_scene(tiles: TilePlan, cfa: Cfa, device: Device, planes: list[Buffer], light: Buffer, number: int) -> None:
    """Compute the tiles of a mosaic that have no samples (`TileChoice.samples_per_axis` 0), in place.

    planes: as for `defocused_mosaic`. light: (mosaics, height, width) float32. number: of the mosaic in it.
    """
    chosen, area, projection = tiles.chosen, tiles.area, tiles.optics.projection
    gathered = chosen.computed & (chosen.samples_per_axis == 0)
    if not gathered.any():
        return
    span = min(device.span, SPAN)
    pupil, inset = tiles.defocus.pupil.turned(projection.turn_rad), 0.5 * (1.0 - projection.open_side)
    steps, counts = np.ceil(chosen.largest_px / RADIUS_STEP_PX), rectangles_of_tiles(tiles)
    for layer, own in enumerate(tiles.defocus.radii_px):
        here = gathered & chosen.visible[layer]
        for step, count in sorted(set(zip(steps[here].tolist(), counts[here].tolist(), strict=True))):
            selected = here & (steps == step) & (counts == count)
            rectangles = _rectangles(pupil, count)
            side = 1.0 - 2.0 * inset + 2.0 * pupil.corner_radius * step * RADIUS_STEP_PX
            graded = isinstance(own, np.ndarray)
            defines = {
                **projection.defines(cfa.macros(area.frame.x, area.frame.y), inset=inset),
                "TAPS": math.ceil(side * projection.scale * projection.extent) + 1 + graded,
                "SPLIT": projection.leaning_parts,
                "SPAN": span,
                "REACH": f"{pupil.corner_radius:.9e}f",
                "RECTANGLES": len(rectangles),
                "GRADED": int(graded),
            }
            size = (TILE_COLUMNS // span, TILE_ROWS, int(selected.sum()))
            arguments = projection.arguments(area.frame.x, area.frame.y)
            del arguments["origin_x"], arguments["origin_y"]
            device.run(
                device.kernel("scene_gather", defines, file="scene_gather.cl"),
                size,
                None,
                planes=planes[layer],
                radius=tiles.maps.radius,
                light=light,
                tiles=device.upload(_places(tiles, selected, 0.0 if graded else float(own))),
                rectangles=device.upload(rectangles),
                frame=_frame(tiles, layer) | {"light_row": number * area.frame.height},
                pose=projection.upload_pose(device),
                **arguments,
            )


def rectangles_of_tiles(tiles: TilePlan) -> np.ndarray:
    """Rectangles of the aperture by which each tile is gathered, (tile rows, tile columns): more where a lamp reaches it."""
    radius_px = np.ceil(tiles.chosen.largest_px / RADIUS_STEP_PX) * RADIUS_STEP_PX
    most = tiles.defocus.gathered_rectangles(radius_px)
    return np.where(_reached_by_lamps(tiles), most, rectangle_count(radius_px))


def _reached_by_lamps(tiles: TilePlan) -> np.ndarray:
    """Whether light of a lamp may reach each tile. Behind a lens that distorts, or where a camera turns, it may reach all."""
    projection, accuracy, area = tiles.optics.projection, tiles.optics.accuracy, tiles.area
    if not accuracy.has_lamps or projection.is_displaced:
        return np.full(area.grid, accuracy.has_lamps)
    reached, scene, weights = np.zeros(area.grid, bool), tiles.optics.scene, tiles.optics.weights
    limit = LAMP_PEAK * accuracy.brightest
    rows, columns = scene.remember(("lamps", freeze(weights), limit), lambda: _lamps(scene, weights, limit))
    reach_px = tiles.defocus.pupil.corner_radius * MOST_PX + 1.0
    down, right = (
        (rows + 0.5 - projection.offset_y) / projection.scale,
        (columns + 0.5 - projection.offset_x) / projection.scale,
    )
    for y, x in itertools.product((down - reach_px, down + reach_px), (right - reach_px, right + reach_px)):
        row, column = (np.floor((y - area.tile_y) / TILE_ROWS), np.floor((x - area.tile_x) / TILE_COLUMNS))
        inside = (row >= 0) & (row < area.grid[0]) & (column >= 0) & (column < area.grid[1])
        reached[row[inside].astype(int), column[inside].astype(int)] = True
    return reached


def _lamps(scene: Scene, weights: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Row and column of the pixels that are brighter than a limit of electron radiance in any channel, in any layer."""
    found = [brighter_pixels(layer.planes, weights, np.array(limit, np.float32))[:2] for layer in scene.layers]
    rows, columns = (np.concatenate(places) for places in zip(*found, strict=True))
    return rows, columns


def _rectangles(pupil: Pupil, count: int) -> np.ndarray:
    """Parts of the aperture: (count,) of `struct rectangle`."""
    found = np.zeros(count, declared_struct(kernel_source("scene_gather.cl"), "rectangle"))
    for name, values in zip(found.dtype.names or (), aperture_rectangles(pupil, count).T, strict=True):
        found[name] = values
    return found


def _places(tiles: TilePlan, selected: np.ndarray, radius_px: float) -> np.ndarray:
    """First photosites in the frame, and blur radius, of the selected tiles: (tiles,) of `struct gathered_tile`."""
    down, right = np.nonzero(selected)
    places = np.zeros(len(down), declared_struct(kernel_source("scene_gather.cl"), "gathered_tile"))
    places["column"] = right * TILE_COLUMNS + tiles.area.tile_x - tiles.area.frame.x
    places["row"] = down * TILE_ROWS + tiles.area.tile_y - tiles.area.frame.y
    places["radius"] = radius_px
    return places


def _frame(tiles: TilePlan, layer: int) -> dict[str, int]:
    """Fields of `struct gather` for a layer."""
    area, radii = tiles.area, tiles.defocus.radii_px
    return {
        "origin_x": area.frame.x,
        "origin_y": area.frame.y,
        "width": area.frame.width,
        "height": area.frame.height,
        "map": sum(isinstance(radius, np.ndarray) for radius in radii[:layer]),
        "map_column": area.frame.x - area.x,
        "map_row": area.frame.y - area.y,
        "map_rows": area.rows,
        "set_columns": area.set_columns,
    }
