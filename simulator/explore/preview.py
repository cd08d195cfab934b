"""The quick picture of a shot: its photosites combined, its scene as coarse as they are."""

import math
from dataclasses import dataclass, replace

from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.scene.reduced import reduce_scene
from simulator.scene.scene import Scene
from simulator.sensor.camera.combined_photosites import combine_photosites

WIDTH_PX = 360  # columns of a preview, at most
TOLERANCE = 1.0  # of its noise, which is as many times less than the frame's as a side has photosites


@dataclass(frozen=True)
class Preview:
    """shot: with the statistics of the large frame in few photosites. side: photosites of the frame along a side of one."""

    shot: Shot
    side: int


def preview_of(shot: Shot, scene: Scene) -> Preview:
    """Return the preview of a shot whose scene has been read.

    Its photosites stand for side x side of the frame's (`combine_photosites`). Where no vectors belong to the scene's pixels,
    the scene has one pixel for each of them, so that nothing is resampled: its field of view is widened or narrowed by less
    than one of them.
    """
    side = max(1, math.ceil(shot.camera.frame.width / WIDTH_PX))
    camera = combine_photosites(shot.camera, side)
    has_vectors = shot.motion is not None and shot.motion.vectors is not None
    coarse = scene if side == 1 or has_vectors else _one_pixel_each(scene, shot, camera.width_px, camera.pixel_pitch_um)
    tolerance = max(shot.tolerance, TOLERANCE) if side > 1 else shot.tolerance
    quick = replace(shot, scene=coarse, camera=camera, tolerance=tolerance, time_budget_s=None, truth=())
    return Preview(quick, side)


def _one_pixel_each(scene: Scene, shot: Shot, width_px: int, pitch_um: float) -> Scene:
    """Return the scene with one pixel for each photosite of this pitch, where it has more."""
    lens = shot.lens
    if scene.field_of_view_deg is None or not isinstance(lens, ThinLens | Pinhole):
        return _remembered(scene, width_px, scene.field_of_view_deg)
    per_px = 1e-3 * pitch_um / lens.image_distance_mm  # tangent of the angle that a photosite sees
    columns = max(2, round(2.0 * math.tan(math.radians(0.5 * scene.field_of_view_deg)) / per_px))
    return _remembered(scene, columns, 2.0 * math.degrees(math.atan(0.5 * columns * per_px)))


def _remembered(scene: Scene, columns: int, field_of_view_deg: float | None) -> Scene:
    """Return the reduced scene, or the scene itself where it is as coarse.

    It is made of the scene at half, a quarter, ... of its columns, which is kept with the scene, since the number of columns
    changes with focus and focal length.
    """
    width = scene.planes.shape[1]
    if width <= columns:
        return scene
    halvings = max(0, math.floor(math.log2(width / (2 * columns))))
    finer = scene.remember(("reduced", halvings), lambda: reduce_scene(scene, width >> halvings))

    def make() -> Scene:
        return replace(reduce_scene(finer, columns), field_of_view_deg=field_of_view_deg)

    return finer.remember(("reduced", columns, field_of_view_deg), make)
