"""The work of a blurred frame whose tiles have their methods, on which its predicted time depends."""

import math

import numpy as np

from simulator.optics.defocus.aperture_kernel import clipped_work
from simulator.optics.defocus.defocus import TILE_COLUMNS, TILE_ROWS
from simulator.optics.defocus.predicted_cost import Work, add, tile_work
from simulator.optics.passes.scene_gather import rectangles_of_tiles
from simulator.optics.passes.tile_grid import BAND_ROWS
from simulator.optics.passes.tile_plan import TilePlan


def work_of(tiles: TilePlan) -> Work:
    """Return the work of all tiles, and of those on wider photosites, which are blurred in each colour."""
    own = tile_work(tiles.chosen, tiles.defocus) | _band_work(tiles) | _gather_work(tiles) | _clipped_work(tiles)
    return own if tiles.wide is None else add(own, work_of(tiles.wide), tiles.optics.channels)


def _band_work(tiles: TilePlan) -> Work:
    """Return the samples of all planes of all layers in the bands of the frame with their margins, and the pixels they read."""
    area, optics, rows_of_band = tiles.area, tiles.optics, BAND_ROWS // TILE_ROWS
    planes = len(optics.scene.layers) * (optics.channels + optics.has_coverage)
    first, samples, reads = (area.tile_y - area.first_band) // TILE_ROWS, 0.0, 0.0
    for over in tiles.chosen.sample_grids():
        rows = np.flatnonzero((tiles.chosen.computed & (tiles.chosen.samples_per_axis == over)).any(axis=1))
        bands = len(np.unique((rows + first) // rows_of_band))
        count = bands * math.prod(area.band_layout(over, whole=True).shape(planes))
        samples += count
        reads += count * optics.projection.taps(1.0 / over) ** 2
    return {"samples": samples, "reads": reads}


def _gather_work(tiles: TilePlan) -> Work:
    """Return the scene pixels that the tiles without samples gather, for each rectangle of the aperture."""
    chosen, projection = tiles.chosen, tiles.optics.projection
    gathered = chosen.computed & (chosen.samples_per_axis == 0)
    if not gathered.any():
        return {}
    radius_px = chosen.largest_px[gathered]
    parts = projection.parts_per_axis(1)
    taps = np.ceil((1.0 / parts + 2.0 * tiles.defocus.pupil.corner_radius * radius_px) * projection.scale) + 1.0
    gathers = (parts * taps) ** 2 * rectangles_of_tiles(tiles)[gathered]
    return {"gathers": float(TILE_ROWS * TILE_COLUMNS * gathers.sum())}


def _clipped_work(tiles: TilePlan) -> Work:
    """Return the work of the images of the aperture that rims clip, at each corner of the zones around the tiles."""
    found: Work = {}
    if tiles.zones is None:
        return found
    area, pupil = tiles.defocus.area, tiles.zones.eyes.pupil
    for over in tiles.chosen.sample_grids():
        chosen = tiles.chosen.part(slice(0, len(tiles.chosen.computed)), over)
        images, places = chosen.table()
        counts = tiles.zones.cut_counts(chosen, images, places)
        for radius_px in {abs(image.radius_px) for image, count in zip(images, counts, strict=True) if count}:
            same = np.array([abs(image.radius_px) == radius_px for image in images])
            each = {f"clipped {name}": work for name, work in clipped_work(pupil, radius_px, over, area).items()}
            found = add(found, {"clipped images": 1.0, **each}, float(counts[same].sum()))
    return found
