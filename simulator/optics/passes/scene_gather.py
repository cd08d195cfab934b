"""The lens blur of small circles in a scene finer than the photosites: tiles that are gathered from the scene's pixels."""

import math

import numpy as np

from simulator.device import Buffer, Device, declared_struct, kernel_source
from simulator.optics.defocus.aperture_rectangles import aperture_rectangles, rectangle_count
from simulator.optics.defocus.defocus import TILE_COLUMNS, TILE_ROWS
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.pupil.pupil import Pupil
from simulator.sensor.camera.cfa import Cfa

RADIUS_STEP_PX = 0.25  # tiles whose blur circles lie between multiples of it share a launch


def gather_scene(tiles: TilePlan, cfa: Cfa, device: Device, planes: list[Buffer], light: Buffer) -> None:
    """Compute the tiles of `light` that have no samples (`TileChoice.samples_per_axis` 0), in place.

    planes: as for `defocused_mosaic`.
    """
    chosen, area, projection = tiles.chosen, tiles.area, tiles.optics.projection
    gathered = chosen.computed & (chosen.samples_per_axis == 0)
    if not gathered.any():
        return
    pupil, inset = tiles.defocus.pupil, 0.5 * (1.0 - projection.open_side)
    for layer, own in enumerate(tiles.defocus.radii_px):
        here = gathered & chosen.visible[layer]
        steps = np.ceil(chosen.largest_px / RADIUS_STEP_PX)
        for step in np.unique(steps[here]).tolist():
            selected = here & (steps == step)
            rectangles = _rectangles(pupil, int(rectangle_count(np.array(step * RADIUS_STEP_PX))))
            graded, macros = (
                isinstance(own, np.ndarray),
                projection.defines(cfa.macros(area.frame.x, area.frame.y), inset=inset),
            )
            side = (1.0 - 2.0 * inset) / projection.parts_per_axis(1) + 2.0 * pupil.corner_radius * step * RADIUS_STEP_PX
            defines = {
                **macros,
                "TAPS": math.ceil(side * projection.scale * projection.stretch) + 1 + graded,
                "REACH": f"{pupil.corner_radius:.9e}f",
                "RECTANGLES": len(rectangles),
                "GRADED": int(graded),
            }
            size = (TILE_COLUMNS, TILE_ROWS, int(selected.sum()))
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
                frame=_frame(tiles, layer),
                pose=projection.upload_pose(device),
                **arguments,
            )


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
