"""Predicts the time of the planned lens blur from the work that each tile's method does.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

from collections.abc import Mapping

import numpy as np

from simulator.optics.defocus.aperture_samples import correction_count, most_samples, sample_count
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, TILE_COLUMNS, TILE_ROWS, Defocus, Method
from simulator.optics.defocus.tile_methods import TileChoice, each_block
from simulator.optics.geometry.projection_cost import COST_NS as PROJECTION_NS

COST_NS = {
    "launches": 3.5e5,  # of a frame; blocks that sample the aperture count as more of them
    "samples": 0.8,  # for each sample of a colour of a layer in a band with its margins: summed
    "gathers": 2.8,  # for each photosite without samples, scene pixel and rectangle of the aperture
    "means": 0.025,  # for each photosite and weight of each image of the aperture that its tile has
    "image samples": 4.9e3,  # for each sample across an image of the aperture
    "corrections": 0.31,  # for each photosite, aperture sample and slab
    "points": 0.16,  # for each photosite and aperture sample that it may take
    "blocks": 100.0,  # for each photosite of blocks that sample the aperture
    "clipped images": 1.1e4,  # for each image of the aperture that rims clip, which the host makes for each frame
    "clipped slices": 17.0,  # for each slice of such an image
    "clipped products": 0.17,  # for each of its weights and part of a photosite that adds it
    "clipped weights": 12.0,  # for each of its weights on the parts of photosites
    **PROJECTION_NS,
}

POINT_LAUNCHES, CORRECTION_LAUNCHES = 1.2, 3.0  # further launches of frames whose blocks sample the aperture

WEIGHTS_PER_PX = 12.0  # of radius, of an image on one sample per photosite

Work = dict[str, float]  # counts, by key of COST_NS


def cost_ms(work: Mapping[str, float]) -> float:
    """Return the predicted time of some work [ms]."""
    return 1e-6 * sum(COST_NS[name] * count for name, count in work.items())


def tile_work(chosen: TileChoice, defocus: Defocus) -> Work:
    """Return the work of tiles whose methods are chosen, without that of the samples that they read."""
    over, widest_px = np.maximum(chosen.samples_per_axis, 1), chosen.largest_px
    meant = chosen.visible & chosen.tiles_with(Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
    weights = np.maximum(chosen.images, 1) * _weights(over, widest_px)
    blocks, over_of_block = chosen.blocks, each_block(chosen.samples_per_axis)
    corrected = blocks.sampled() & (blocks.methods == Method.CORRECTED)
    occluding = blocks.sampled() & (blocks.methods == Method.OCCLUSION)
    corrections = correction_count(sample_count(blocks.largest_px, defocus), over_of_block) * _slab_counts(chosen, defocus)
    images, _ = chosen.table()
    finest = int(over[chosen.computed].max(initial=1))
    block_px = BLOCK_ROWS * BLOCK_COLUMNS
    return {
        "launches": 1.0 + POINT_LAUNCHES * bool(occluding.any()) + CORRECTION_LAUNCHES * bool(corrected.any()),
        "means": float(TILE_ROWS * TILE_COLUMNS * (meant * weights).sum()),
        "image samples": float(sum(2.0 * finest * abs(image.radius_px) + 1.0 for image in images)),
        "corrections": float(block_px * corrections[corrected].sum()),
        "points": float(block_px * most_samples(blocks.largest_px, defocus)[occluding].sum()),
        "blocks": float(block_px * occluding.sum()),
    }


def assumed_work(defocus: Defocus, over: int, width_px: int, height_px: int, occluding: float) -> Work:
    """Return the work of tiles that are not measured, without that of the samples that they read.

    Circles have the largest radius, and that of a map varies evenly across the frame. over: samples per photosite and axis.
    width_px, height_px: photosites. occluding: assumed share of blocks that sample the aperture.
    """
    pixels, radius = width_px * height_px, np.array(defocus.largest_px)
    of_tile_px = (defocus.greatest_px - defocus.least_px) / -(-width_px // TILE_COLUMNS)
    images = 1.0 + defocus.nodes_per_px * of_tile_px * bool(defocus.maps)
    return {
        "launches": 1.0 + POINT_LAUNCHES * (occluding > 0.0),
        "means": pixels * len(defocus.radii_px) * images * float(_weights(over, radius)),
        "image samples": 2.0 * over * defocus.largest_px + 1.0,
        "points": occluding * pixels * float(most_samples(radius, defocus)),
        "blocks": occluding * pixels,
    }


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
