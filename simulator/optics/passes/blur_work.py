"""The work of a blurred frame whose tiles have their methods, on which its predicted time depends."""

import math

import numpy as np

from simulator.optics.defocus.aperture_kernel import clipped_work
from simulator.optics.defocus.defocus import TILE_COLUMNS, TILE_ROWS, Defocus
from simulator.optics.defocus.predicted_cost import Work, add, assumed_work, cost_ms, tile_work
from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.projection_cost import projection_work
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.scene_gather import rectangles_of_tiles
from simulator.optics.passes.tile_grid import BAND_ROWS, TileGrid
from simulator.optics.passes.tile_plan import TilePlan


def work_of(tiles: TilePlan) -> Work:
    """Return the work of all tiles, and of those on wider photosites, which are blurred in each colour."""
    colors = len(tiles.optics.cfa.colors) if tiles.optics.psf is not None and not tiles.only_covariance else 1
    of_colors = tile_work(tiles.chosen, tiles.defocus) | _gather_work(tiles)  # a mosaic of each, where a convolution follows
    own = add({}, of_colors, colors) | _band_work(tiles) | _clipped_work(tiles)
    return own if tiles.wide is None else add(own, work_of(tiles.wide), tiles.optics.channels)


def unmeasured_work(optics: OpticsPlan, occluding: float) -> Work:
    """Return the work of a blur whose tiles are not measured: all surfaces at their largest radius, on samples for the least.

    occluding: assumed share of blocks that sample the aperture.
    """
    defocus, window = _defocus_of(optics), optics.blur_window()
    least_px, largest_px = _ends_px(defocus)
    over = _unmeasured_samples_per_axis(defocus)
    found = assumed_work(defocus, over, window.width, window.height, occluding) | unmeasured_samples(optics)
    if defocus.gathers_scene(least_px, largest_px):
        rectangles = float(defocus.gathered_rectangles(largest_px))
        gathers = window.width * window.height * rectangles * float(_gathered_taps(optics.projection, defocus, largest_px))
        found = min(found, {"launches": 1.0, "gathers": gathers}, key=cost_ms)
    return found


def unmeasured_samples(optics: OpticsPlan) -> Work:
    """Return the work of the samples of a blur whose tiles are not measured: those that the least radius needs."""
    defocus = _defocus_of(optics)
    area = TileGrid(optics.blur_window(), defocus.reach_px)
    return add({}, _sampled(optics, area, _unmeasured_samples_per_axis(defocus)), area.bands)


def _unmeasured_samples_per_axis(defocus: Defocus) -> int:
    least_px, largest_px = _ends_px(defocus)
    return max(int(defocus.samples_per_axis(least_px, largest_px)), 1)


def _ends_px(defocus: Defocus) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest blur radius, without signs."""
    ends = defocus.ranges_px
    return np.array(min(least for least, _ in ends)), np.array(max(most for _, most in ends))


def _defocus_of(optics: OpticsPlan) -> Defocus:
    assert optics.defocus is not None  # it is the blur whose work is predicted
    return optics.defocus


def _band_work(tiles: TilePlan) -> Work:
    """Return the samples of all planes of all layers in the bands of the frame with their margins, and the pixels they read."""
    area, optics, rows_of_band = tiles.area, tiles.optics, BAND_ROWS // TILE_ROWS
    first = (area.tile_y - area.first_band) // TILE_ROWS
    found: Work = {}
    for over in tiles.chosen.sample_grids():
        rows = np.flatnonzero((tiles.chosen.computed & (tiles.chosen.samples_per_axis == over)).any(axis=1))
        bands = len(np.unique((rows + first) // rows_of_band))
        found = add(found, _sampled(optics, area, over), bands)
    return found


def _sampled(optics: OpticsPlan, area: TileGrid, over: int) -> Work:
    """Return the work of the samples of all planes of all layers in a band of a frame."""
    planes = len(optics.scene.layers) * (optics.channels + optics.has_coverage)
    samples = float(math.prod(area.band_layout(over, whole=True).shape(planes)))
    return {"samples": samples, **projection_work(optics.projection, over, samples)}


def _gather_work(tiles: TilePlan) -> Work:
    """Return the scene pixels that the tiles without samples gather, for each rectangle of the aperture."""
    chosen, projection = tiles.chosen, tiles.optics.projection
    gathered = chosen.computed & (chosen.samples_per_axis == 0)
    if not gathered.any():
        return {}
    gathers = _gathered_taps(projection, tiles.defocus, chosen.largest_px[gathered]) * rectangles_of_tiles(tiles)[gathered]
    window, of_tiles = tiles.optics.window, TILE_ROWS * TILE_COLUMNS * math.prod(tiles.area.grid)
    return {"gathers": float(TILE_ROWS * TILE_COLUMNS * gathers.sum() * window.width * window.height / of_tiles)}


def _gathered_taps(projection: Projection, defocus: Defocus, radius_px: np.ndarray) -> np.ndarray:
    """Scene pixels that a photosite without samples may touch through a rectangle of the aperture, of all its upright parts."""
    parts = projection.parts_per_axis(1)
    taps = np.ceil((1.0 / parts + 2.0 * defocus.pupil.corner_radius * radius_px) * projection.scale) + 1.0
    return (parts * taps) ** 2


def _clipped_work(tiles: TilePlan) -> Work:
    """Return the work of the images of the aperture that rims clip, at each corner of the zones around the tiles."""
    found: Work = {}
    if tiles.zones is None:
        return found
    area, pupil = tiles.defocus.area, tiles.zones.eyes.pupil
    for over in tiles.chosen.sample_grids():
        chosen = tiles.chosen.part(slice(0, len(tiles.chosen.computed)), over)
        images, places = chosen.table()
        radii_px, index = np.unique([abs(image.radius_px) for image in images], return_inverse=True)
        counts = np.bincount(index, tiles.zones.cut_counts(chosen, images, places), len(radii_px))
        for radius_px, count in zip(radii_px[counts > 0].tolist(), counts[counts > 0].tolist(), strict=True):
            each = {f"clipped {name}": work for name, work in clipped_work(pupil, radius_px, over, area).items()}
            found = add(found, {"clipped images": 1.0, **each}, count)
    return found
