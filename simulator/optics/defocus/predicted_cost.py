"""Predicts the time of the planned lens blur from the work that each tile's method does.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

import math
from collections.abc import Mapping

import numpy as np

from simulator.optics.defocus.aperture_samples import (
    CORRECTION_LEAST,
    FEWEST_OF_ALL,
    correction_count,
    most_samples,
    sample_count,
    takes_as_needed,
)
from simulator.optics.defocus.defocus import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    CLASS_UNIT_PX,
    TILE_COLUMNS,
    TILE_ROWS,
    Defocus,
    Method,
)
from simulator.optics.defocus.tile_methods import TileChoice, each_block
from simulator.optics.geometry.projection_cost import COST_NS as PROJECTION_NS

COST_NS = {
    "frame": 5.5e5,  # of a frame: tables and buffers
    "launches": 7.5e4,  # for each kernel that is launched
    "samples": 0.75,  # for each sample of a colour of a layer in a band with its margins: summed
    "gathers": 0.65,  # for each photosite without samples, rectangle of the aperture and scene pixel on an axis that it touches
    "means": 0.016,  # for each photosite and weight of each image of the aperture that its tile has
    "image samples": 4.9e3,  # for each sample across an image of the aperture
    "corrections": 0.31,  # for each photosite, aperture sample and slab
    "points": 0.095,  # for each photosite, aperture sample that it may take, and slab
    "blocks": 20.0,  # for each photosite of blocks that sample the aperture
    "clipped images": 1.1e4,  # for each image of the aperture that rims clip, which the host makes for each frame
    "clipped slices": 17.0,  # for each slice of such an image
    "clipped products": 0.17,  # for each of its weights and part of a photosite that adds it
    "clipped weights": 12.0,  # for each of its weights on the parts of photosites
    **PROJECTION_NS,
}

FINE_POINTS = 1.7  # times the work of a point where photosites have several samples, which lie in more places
# What one more colour of the same launch adds to the work of a point, and of one that adds to the sums of each layer.
MORE_COLORS, MORE_SUMS = 0.28, 0.5
PAIRED = 0.26  # times the work of a correction of two layers, whose sums stay in registers (kernels/layer_covariance.cl)
COMPARED = 2  # times as many samples of a correction as those after which it is first compared: then it may agree

WEIGHTS_PER_PX = 12.0  # of radius, of an image on one sample per photosite

Work = dict[str, float]  # counts, by key of COST_NS


def cost_ms(work: Mapping[str, float]) -> float:
    """Return the predicted time of some work [ms]."""
    return 1e-6 * sum(COST_NS[name] * count for name, count in work.items())


def tile_work(chosen: TileChoice, defocus: Defocus, colors: int = 1) -> Work:
    """Return the work of tiles whose methods are chosen, without that of the samples that they read, and without launches.

    colors: mosaics that are made together. Each has means of its own; aperture samples are found once for all of them.
    """
    over, widest_px = np.maximum(chosen.samples_per_axis, 1), chosen.largest_px
    meant = chosen.visible & chosen.tiles_with(Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
    weights = np.maximum(chosen.images, 1) * _weights(over, widest_px)
    blocks, over_of_block = chosen.blocks, each_block(chosen.samples_per_axis)
    corrected = blocks.sampled() & (blocks.methods == Method.CORRECTED)
    occluding = blocks.sampled() & (blocks.methods == Method.OCCLUSION)
    slabs = _slab_counts(chosen, defocus)
    paired = np.where(slabs == 2, PAIRED, 1.0)
    points = points_work(most_samples(blocks.largest_px, defocus), over_of_block, colors) * slabs
    images, _ = chosen.table()
    finest = int(over[chosen.computed].max(initial=1))
    block_px = BLOCK_ROWS * BLOCK_COLUMNS
    return {
        "frame": 1.0,
        "means": float(colors * TILE_ROWS * TILE_COLUMNS * (meant * weights).sum()),
        "image samples": float(sum(2.0 * finest * abs(image.radius_px) + 1.0 for image in images)),
        "corrections": float(block_px * (_correction_work(chosen, defocus, colors) * slabs * paired)[corrected].sum()),
        "points": float(block_px * points[occluding].sum()),
        "blocks": float(block_px * (occluding | corrected).sum()),
    }


def points_work(count: np.ndarray, over: np.ndarray | int, colors: int) -> np.ndarray:
    """Work of a photosite with so many aperture samples of one slab, in units of "points".

    over: samples per photosite and axis. colors: mosaics that are made together.
    """
    return count * np.where(np.greater(over, 1), FINE_POINTS, 1.0) * (1.0 + MORE_COLORS * (colors - 1))


def _correction_work(chosen: TileChoice, defocus: Defocus, colors: int) -> np.ndarray:
    """Aperture samples of a slab that each block takes for a correction, in units of "corrections".

    Those that are compared take twice as many as they are first compared after, where their light agrees as it mostly does.
    """
    over = each_block(chosen.samples_per_axis)
    count = correction_count(sample_count(chosen.blocks.largest_px, defocus), over, defocus)
    if takes_as_needed(defocus):
        compared = COMPARED * np.maximum(count // CORRECTION_LEAST, FEWEST_OF_ALL)
        count = np.where(over > 1, count, np.minimum(count, compared))
    return np.asarray(count * (1.0 + MORE_SUMS * (colors - 1)))


def assumed_work(defocus: Defocus, over: int, width_px: int, height_px: int, occluding: float) -> Work:
    """Return the work of tiles that are not measured, without that of the samples that they read, and without launches.

    Circles have the largest radius, and that of a map varies evenly across the frame. over: samples per photosite and axis.
    width_px, height_px: photosites. occluding: assumed share of blocks that sample the aperture.
    """
    pixels, radius = width_px * height_px, np.array(defocus.largest_px)
    of_tile_px = (defocus.greatest_px - defocus.least_px) / -(-width_px // TILE_COLUMNS)
    images = 1.0 + defocus.nodes_per_px * of_tile_px * bool(defocus.maps)
    points = float(points_work(most_samples(radius, defocus), over, 1)) * assumed_slabs(defocus)
    return {
        "frame": 1.0,
        "means": pixels * len(defocus.radii_px) * images * float(_weights(over, radius)),
        "image samples": 2.0 * over * defocus.largest_px + 1.0,
        "points": occluding * pixels * points,
        "blocks": occluding * pixels,
    }


def assumed_slabs(defocus: Defocus) -> float:
    """Return how many slabs of radius a block samples that may see all of the scene: one of each layer, and those of maps."""
    classes = [
        defocus.classes_per_unit * (math.asinh(most / CLASS_UNIT_PX) - math.asinh(least / CLASS_UNIT_PX)) * defocus.slab_parts
        for least, most in ((float(np.min(radius)), float(np.max(radius))) for radius in defocus.radii_px)
    ]
    return sum(1.0 + each for each in classes)


def _weights(over: np.ndarray | int, radius_px: np.ndarray) -> np.ndarray:
    """Weights of an image of the aperture on `over` x `over` samples per photosite: those along its rim, for each sample."""
    return np.asarray(over**2 * (WEIGHTS_PER_PX * radius_px + 1.0))


def add(first: Work, second: Work, times: float) -> Work:
    """Return the first work and so many times the second."""
    return {name: first.get(name, 0.0) + times * second.get(name, 0.0) for name in {*first, *second}}


def _slab_counts(chosen: TileChoice, defocus: Defocus) -> np.ndarray:
    """Return how many slabs of radius each block samples, (block rows, block columns)."""
    blocks = chosen.blocks
    classes = np.bitwise_count(blocks.present).astype(int)
    is_flat = np.array([np.ndim(radius) == 0 for radius in defocus.radii_px])[:, None, None]
    return np.where(is_flat | ~np.isnan(blocks.even_px), np.minimum(classes, 1), classes).sum(axis=0)
