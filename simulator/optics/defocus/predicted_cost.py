"""Predicts the time of the planned lens blur from the work that each tile's method does.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

from collections.abc import Mapping

import numpy as np

from simulator.optics.defocus.aperture_samples import correction_count, most_samples, sample_count
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, TILE_COLUMNS, TILE_ROWS, Defocus, Method
from simulator.optics.defocus.tile_methods import TileChoice, each_block

COST_NS = {
    "launches": 5.0e5,  # of a frame; blocks that sample the aperture count as more of them
    "samples": 1.2,  # for each sample of a colour of a layer in a band with its margins: projected, summed
    "reads": 0.41,  # for each scene pixel that such a sample is the mean of
    "gathers": 2.8,  # for each photosite without samples, scene pixel and rectangle of the aperture
    "means": 0.5,  # for each photosite and row of samples of an aperture's image that it reads, twice where the radius varies
    "image samples": 4.9e3,  # for each sample across an image of the aperture
    "corrections": 0.31,  # for each photosite, aperture sample and slab
    "points": 0.08,  # for each photosite and aperture sample that it may take
    "blocks": 55.0,  # for each photosite of blocks that sample the aperture
    "clipped images": 1.1e4,  # for each image of the aperture that rims clip, which the host makes for each frame
    "clipped slices": 17.0,  # for each slice of such an image
    "clipped products": 0.17,  # for each of its weights and part of a photosite that adds it
    "clipped weights": 12.0,  # for each of its weights on the parts of photosites
}

POINT_LAUNCHES, CORRECTION_LAUNCHES = 5.0, 6.0  # further launches of frames whose blocks sample the aperture

Work = dict[str, float]  # counts, by key of COST_NS


def cost_ms(work: Mapping[str, float]) -> float:
    """Return the predicted time of some work [ms]."""
    return 1e-6 * sum(COST_NS[name] * count for name, count in work.items())


def tile_work(chosen: TileChoice, defocus: Defocus) -> Work:
    """Return the work of tiles whose methods are chosen, without that of the samples that they read."""
    over, widest_px = np.maximum(chosen.samples_per_axis, 1), chosen.largest_px
    meant = chosen.visible & chosen.tiles_with(Method.MEAN, Method.COMPOSITE, Method.CORRECTED)
    rows = np.where(chosen.constant, 1.0, 2.0) * (2.0 * over * widest_px + 2.0)
    blocks, over_of_block = chosen.blocks, each_block(chosen.samples_per_axis)
    corrected = blocks.sampled() & (blocks.methods == Method.CORRECTED)
    occluding = blocks.sampled() & (blocks.methods == Method.OCCLUSION)
    corrections = correction_count(sample_count(blocks.largest_px, defocus), over_of_block) * _slab_counts(chosen, defocus)
    images, _ = chosen.table()
    finest = int(over[chosen.computed].max(initial=1))
    block_px = BLOCK_ROWS * BLOCK_COLUMNS
    return {
        "launches": 1.0 + POINT_LAUNCHES * bool(occluding.any()) + CORRECTION_LAUNCHES * bool(corrected.any()),
        "means": float(TILE_ROWS * TILE_COLUMNS * (meant * rows).sum()),
        "image samples": float(sum(2.0 * finest * abs(image.radius_px) + 1.0 for image in images)),
        "corrections": float(block_px * corrections[corrected].sum()),
        "points": float(block_px * most_samples(blocks.largest_px, defocus)[occluding].sum()),
        "blocks": float(block_px * occluding.sum()),
    }


def assumed_work(defocus: Defocus, pixels: int, planes: int, occluding: float) -> Work:
    """Return the work of tiles that are not measured: all surfaces at their largest radius.

    pixels: photosites. planes: colours, and coverage. occluding: assumed share of blocks that sample the aperture.
    """
    radius = np.array(defocus.largest_px)
    over, layers = int(defocus.samples_per_axis(radius, radius)), len(defocus.radii_px)
    graded = 2.0 if defocus.maps else 1.0
    return {
        "launches": 1.0 + POINT_LAUNCHES * (occluding > 0.0),
        "samples": float(pixels * over**2 * layers * planes),
        "means": pixels * layers * graded * (2.0 * over * defocus.largest_px + 2.0),
        "image samples": 2.0 * over * defocus.largest_px + 1.0,
        "points": occluding * pixels * float(most_samples(radius, defocus)),
        "blocks": occluding * pixels,
    }


def add(first: Work, second: Work, times: float) -> Work:
    """Return the first work and so many times the second."""
    return {name: first.get(name, 0.0) + times * second.get(name, 0.0) for name in {*first, *second}}


def _slab_counts(chosen: TileChoice, defocus: Defocus) -> np.ndarray:
    """Return how many slabs of radius each block samples, (block rows, block columns)."""
    blocks = chosen.blocks
    classes = np.bitwise_count(blocks.present).astype(int)
    is_flat = np.array([np.ndim(radius) == 0 for radius in defocus.radii_px])[:, None, None]
    return np.where(is_flat | ~np.isnan(blocks.even_px), np.minimum(classes, 1), classes).sum(axis=0)
