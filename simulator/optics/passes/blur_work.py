"""The work of a blurred frame whose tiles have their methods, on which its predicted time depends."""

import math

import numpy as np

from simulator.optics.defocus.aperture_rectangles import rectangle_count
from simulator.optics.defocus.defocus import TILE_COLUMNS, TILE_ROWS
from simulator.optics.defocus.predicted_cost import Work, add, tile_work
from simulator.optics.passes.tile_grid import BAND_ROWS
from simulator.optics.passes.tile_plan import TilePlan


def work_of(tiles: TilePlan) -> Work:
    """Return the work of all tiles, and of those on wider photosites, which are blurred in each colour."""
    own = tile_work(tiles.chosen, tiles.defocus) | _band_work(tiles) | _gather_work(tiles)
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
    taps = np.ceil((1.0 + 2.0 * tiles.defocus.pupil.corner_radius * radius_px) * projection.scale) + 1.0
    return {"gathers": float(TILE_ROWS * TILE_COLUMNS * (taps**2 * rectangle_count(radius_px)).sum())}
