"""Predicts the time in which the scene is projected onto samples of photosites.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

from simulator.optics.geometry.footprint import pixels_read
from simulator.optics.geometry.projection import Projection

COST_NS = {
    "copied samples": 0.25,  # for each sample that is a pixel of the scene
    "separable samples": 0.7,  # for each sample of a scene much coarser than its samples, read across and then down
    "bilinear samples": 2.0,  # for each part of a sample of another scene that is not finer than the photosites
    "distorted samples": 4.0,  # more for each sample whose place distortion moves
    "posed samples": 2.5,  # the same of a pose of the camera
    "pixel samples": 1.2,  # for each sample within one pixel
    "square samples": 0.6,  # for each upright sample that even squares of the scene cross
    "square reads": 0.45,  # for each scene pixel that it may touch
    "footprint reads": 0.25,  # for each pixel that a sample over several squares, or a row of the scene at its column, reads
    "leaning samples": 3.0,  # for each sample that is a parallelogram
    "leaning reads": 0.8,  # for each scene pixel that it may touch
}


def projection_work(projection: Projection, over: int, samples: float) -> dict[str, float]:
    """Return the work of so many samples of all planes, counts by key of COST_NS; `over` samples per photosite and axis."""
    if footprints := projection.footprints or projection.sample_footprints(1, over):
        reach_px = max(one.reach_px for one in footprints)
        reads = pixels_read(reach_px, projection.scale, is_tent=projection.is_bilinear)
        return {"footprint reads": samples * reads * (1.0 + projection.scale / over)}
    leans = projection.has_leaning(over)
    taps = projection.taps(1.0 / over, leans)
    if projection.copies_pixels(over):
        return {"copied samples": samples}
    if projection.is_separable(over):
        return {"separable samples": samples}
    moved = {"distorted samples": samples} if projection.warp is not None else {}
    moved |= {"posed samples": samples} if projection.pose is not None else {}
    if not taps:
        return {**moved, "bilinear samples": samples * (-(-projection.samples // over)) ** 2}
    if leans:
        return {**moved, "leaning samples": samples, "leaning reads": samples * taps**2}
    if taps == 1:
        return {**moved, "pixel samples": samples}
    return {**moved, "square samples": samples, "square reads": samples * taps**2}
