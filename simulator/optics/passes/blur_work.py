"""The work of a blurred frame whose tiles have their methods, on which its predicted time depends."""

import math

import numpy as np

from simulator.optics.defocus.aperture_kernel import DIRECT, clipped_work
from simulator.optics.defocus.aperture_samples import sample_count
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, TILE_COLUMNS, TILE_ROWS, Defocus, Method
from simulator.optics.defocus.predicted_cost import Work, add, assumed_slabs, assumed_work, cost_ms, points_work, tile_work
from simulator.optics.defocus.tile_methods import each_block
from simulator.optics.geometry.motion_cost import CLIPPED_TABLES, TURNED, TURNED_TABLES
from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.projection_cost import projection_work
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.scene_gather import rectangles_of_tiles
from simulator.optics.passes.tile_grid import BAND_ROWS, TileGrid
from simulator.optics.passes.tile_plan import TilePlan

LEANING, PRODUCT = 3.0, 0.08  # work of a pixel's shares where photosites lean, and of a product of two, in those of one share


def work_of(tiles: TilePlan) -> Work:
    """Return the work of all tiles, and of those on wider photosites, which are blurred in each colour.

    Where a convolution follows, a mosaic of each colour is made, all of them by the same launches.
    """
    colors = len(tiles.optics.cfa.colors) if tiles.optics.psf is not None and not tiles.only_covariance else 1
    gathered = add({}, _gather_work(tiles), colors)
    own = tile_work(tiles.chosen, tiles.defocus, colors) | gathered | _band_work(tiles) | _clipped_work(tiles)
    if tiles.wide is None:
        return own
    return add(own, work_of(tiles.wide), tiles.optics.channels if tiles.defocus.wider == 1 else 1)


def unmeasured_work(optics: OpticsPlan, occluding: float) -> Work:
    """Return the work of a blur whose tiles are not measured: all surfaces at their largest radius, on samples for the least.

    occluding: assumed share of blocks that sample the aperture.
    """
    defocus, window = _defocus_of(optics), optics.blur_window()
    least_px, largest_px = _ends_px(defocus)
    over = _unmeasured_samples_per_axis(defocus)
    samples = unmeasured_samples(optics, reads_maps=occluding > 0.0)
    found = assumed_work(defocus, over, window.width, window.height, occluding) | samples
    found["launches"] = 3.0 * len(optics.scene.layers) * TileGrid(window, defocus.reach_px).bands
    if occluding:
        found = add(found, _wider_samples(optics), optics.channels)
    if defocus.gathers_scene(least_px, largest_px):
        rectangles = float(defocus.gathered_rectangles(largest_px))
        gathers = window.width * window.height * rectangles * float(_gathered_pixels(optics.projection, defocus, largest_px))
        found = min(found, {"frame": 1.0, "launches": 1.0, "gathers": gathers}, key=cost_ms)
    return found


def moving_work(optics: OpticsPlan) -> tuple[Work, float, float]:
    """Return the work of the samples that points of the aperture read which carry instants, and that of points and tables.

    Points and tables: in units of `motion_cost.COST_NS`.
    """
    defocus, blur, layers = _defocus_of(optics), optics.moving_blur, len(optics.scene.layers)
    assert blur is not None and blur.motion is not None  # it carries them
    colors, over = 1 if optics.psf is None else len(optics.cfa.colors), _unmeasured_samples_per_axis(defocus)
    area, cells = TileGrid(optics.blur_window(), blur.reach_px), blur.motion.cells(BLOCK_COLUMNS, BLOCK_ROWS)
    rows, columns = TILE_ROWS * area.grid[0], TILE_COLUMNS * area.grid[1]
    count, is_turned = sample_count(np.array(blur.largest_px), blur), cells.points == "places"
    points = rows * columns * float(points_work(count, over, colors)) * assumed_slabs(blur) * (TURNED if is_turned else 1.0)
    own = math.ceil(columns / cells.columns) * math.ceil(rows / cells.rows), TURNED_TABLES if is_turned else 1.0
    if blur.eyes is not None:
        own = math.ceil(columns / BLOCK_COLUMNS) * math.ceil(rows / min(cells.rows, BLOCK_ROWS)), CLIPPED_TABLES
    found = add(unmeasured_samples(optics, reads_maps=True, whole=False), _wider_samples(optics), optics.channels)
    found |= {"launches": 3.0 * layers * area.bands}
    return found, points, own[0] * own[1] * layers * float(count)


def _wider_samples(optics: OpticsPlan) -> Work:
    """Return the work of samples of one colour on wider photosites, as large circles may need them, of all widths."""
    defocus = _defocus_of(optics)
    if defocus.largest_px < defocus.wide_px:
        return {}
    wider = optics.on_wider_photosites()
    return add(unmeasured_samples(wider, reads_maps=True), _wider_samples(wider), 1.0)


def unmeasured_samples(optics: OpticsPlan, *, reads_maps: bool, whole: bool | None = None) -> Work:
    """Return the work of the samples of a blur whose tiles are not measured: those that the least radius needs.

    reads_maps: as of `_sampled`. whole: as of `TileGrid.band_layout`; None: where means over the largest circle read running
    sums.
    """
    defocus = _defocus_of(optics)
    area, over = TileGrid(optics.blur_window(), defocus.reach_px), _unmeasured_samples_per_axis(defocus)
    whole = _reads_sums(over, defocus.largest_px) if whole is None else whole
    return add({}, _sampled(optics, area, over, whole=whole, reads_maps=reads_maps), area.bands)


def _reads_sums(over: int, radius_px: float) -> bool:
    """Whether the mean over a circle of this radius reads running sums, on `over` x `over` samples per photosite."""
    return (2.0 * over * radius_px + over) ** 2 > DIRECT


def _unmeasured_samples_per_axis(defocus: Defocus) -> int:
    least_px, largest_px = _ends_px(defocus)
    return max(int(defocus.samples_per_axis(least_px, largest_px)), min(defocus.wider, 4))  # as `tile_methods` chooses


def _ends_px(defocus: Defocus) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest blur radius, without signs."""
    ends = defocus.ranges_px
    return np.array(min(least for least, _ in ends)), np.array(max(most for _, most in ends))


def _defocus_of(optics: OpticsPlan) -> Defocus:
    assert optics.defocus is not None  # it is the blur whose work is predicted
    return optics.defocus


def _band_work(tiles: TilePlan) -> Work:
    """Return the samples of all layers in the bands of the frame with their margins, the pixels that they read, and launches.

    A band is sampled as a whole where means read running sums; else the rows around its tiles are.
    """
    area, optics, chosen, rows_of_band = tiles.area, tiles.optics, tiles.chosen, BAND_ROWS // TILE_ROWS
    first = (area.tile_y - area.first_band) // TILE_ROWS
    meant, layers = chosen.tiles_with(Method.MEAN, Method.COMPOSITE, Method.CORRECTED), len(optics.scene.layers)
    found: Work = {}
    for over in chosen.sample_grids():
        own = chosen.computed & (chosen.samples_per_axis == over)
        bands = len(np.unique((np.flatnonzero(own.any(axis=1)) + first) // rows_of_band))
        widest_px = float(chosen.largest_px[own & meant].max(initial=0.0))
        sums = _reads_sums(over, widest_px) and bool((own & meant).any())
        whole, samples = sums or tiles.highlight_limit is not None, bool((chosen.blocks.sampled() & each_block(own)).any())
        each = _sampled(optics, area, over, whole=whole, reads_maps=samples)
        each["launches"] = layers * (1.0 + bool((own & meant).any()) + sums + samples) + 2.0 * samples
        found = add(found, each, bands)
    return found


def _sampled(optics: OpticsPlan, area: TileGrid, over: int, *, whole: bool, reads_maps: bool) -> Work:
    """Return the work of the samples of all planes of all layers in a band of a frame. whole: as of `TileGrid.band_layout`.

    reads_maps: whether blocks sample the aperture, for which maps of blur radii are projected as planes of light are; at one
    sample per photosite they are there.
    """
    assert optics.defocus is not None  # its samples are blurred
    planes = len(optics.scene.layers) * (optics.channels + optics.has_coverage)
    each = float(math.prod(area.band_layout(over, whole=whole).shape(1)))
    maps = optics.defocus.maps * (reads_maps and over > 1)
    return {"samples": planes * each, **projection_work(optics.projection, over, (planes + maps) * each)}


def _gather_work(tiles: TilePlan) -> Work:
    """Return the scene pixels that the tiles without samples gather, for each rectangle of the aperture."""
    chosen, projection = tiles.chosen, tiles.optics.projection
    gathered = chosen.computed & (chosen.samples_per_axis == 0)
    if not gathered.any():
        return {}
    gathers = _gathered_pixels(projection, tiles.defocus, chosen.largest_px[gathered]) * rectangles_of_tiles(tiles)[gathered]
    window, of_tiles = tiles.optics.window, TILE_ROWS * TILE_COLUMNS * math.prod(tiles.area.grid)
    return {"gathers": float(TILE_ROWS * TILE_COLUMNS * gathers.sum() * window.width * window.height / of_tiles)}


def _gathered_pixels(projection: Projection, defocus: Defocus, radius_px: np.ndarray) -> np.ndarray:
    """Scene pixels on an axis that a photosite without samples and a rectangle of the aperture may touch, as they take time."""
    touched = np.ceil((1.0 + 2.0 * defocus.pupil.corner_radius * radius_px) * projection.scale * projection.extent) + 1.0
    shares = LEANING if projection.has_leaning(1) else 1.0
    return projection.leaning_parts**2 * touched * (shares + PRODUCT * touched)


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
