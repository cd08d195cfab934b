"""The quick picture of a shot: its photosites combined, its scene as coarse as they are."""

import math
from dataclasses import dataclass, replace

from simulator.explore.pace import COLUMNS_PX
from simulator.optics.geometry.projection import seen_pixels
from simulator.optics.geometry.surroundings import widest_blur_px
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.raw.dng.writer import SMALLEST_SIDE_PX
from simulator.scene.reduced import crop_scene, reduce_scene
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.combined_photosites import combine_photosites

WIDTH_PX = COLUMNS_PX[0]  # columns of a preview at rest, at most
TOLERANCE = 1.0  # of its noise, which is as many times less than the frame's as a side has photosites
MOVING_TOLERANCE = 4.0  # of the noise of a preview with less columns, while a control is moved
BEYOND_PX = 16  # photosites of the preview around what the camera sees, besides the widest blur circle


@dataclass(frozen=True)
class Preview:
    """shot: with the statistics of the large frame in few photosites. side: photosites of the frame along a side of one."""

    shot: Shot
    side: int


def preview_of(shot: Shot, scene: Scene, width_px: int = WIDTH_PX) -> Preview:
    """Return the preview of a shot whose scene has been read, of at most `width_px` columns.

    Its photosites stand for side x side of the frame's (`combine_photosites`). Where nothing moves on the scene's pixels,
    the scene has one pixel for each of them, so that nothing is resampled: its field of view is widened or narrowed by less
    than one of them. Of a scene in which nothing moves, what lies farther outside than a blur circle reaches is left out.
    """
    (camera, side), motion = _combine(shot.camera, width_px), shot.motion
    has_parts = motion is not None and (motion.vectors is not None or bool(motion.layers))  # their paths are in its pixels
    coarse = scene if side == 1 or has_parts else _one_pixel_each(scene, shot, camera)
    allowed = TOLERANCE if width_px >= WIDTH_PX else MOVING_TOLERANCE
    tolerance = max(shot.tolerance, allowed) if side > 1 else shot.tolerance
    quick = replace(shot, scene=coarse, camera=camera, tolerance=tolerance, time_budget_s=None, truth=())
    return Preview(quick, side)


def _combine(camera: Camera, width_px: int) -> tuple[Camera, int]:
    """Return the body of a preview of at most so many columns, and how many photosites stand along a side of one of its own.

    The mean of codes is what a photosite of a preview shows, so that those that the camera averages need not be averaged first.
    A strip has more columns, so that its preview is no lower than a frame that is developed.
    """
    factor, frame = 1 if camera.binning is None else camera.binning.factor, camera.frame
    largest = min(frame.width, frame.height) // (factor * SMALLEST_SIDE_PX)
    if frame.width <= factor * width_px or largest < 2:
        return camera, 1
    if camera.binning is not None and camera.binning.mode == "average" and camera.filter.is_small:
        camera, factor = replace(camera, binning=None), 1
        largest = min(frame.width, frame.height) // SMALLEST_SIDE_PX
    side = min(math.ceil(frame.width / (factor * width_px)), largest)
    return combine_photosites(camera, side), side


def _one_pixel_each(scene: Scene, shot: Shot, camera: Camera) -> Scene:
    """Return the scene with one pixel for each photosite of this camera, where it has more."""
    lens = shot.lens
    if scene.field_of_view_deg is None or not isinstance(lens, ThinLens | Pinhole):
        return _remembered(scene, camera.width_px, scene.field_of_view_deg)
    if shot.motion is None:
        scene = _middle(scene, lens, camera)
    assert scene.field_of_view_deg is not None  # its middle has one, too
    per_px = 1e-3 * camera.pixel_pitch_um / lens.image_distance_mm  # tangent of the angle that a photosite sees
    columns = max(2, round(2.0 * math.tan(math.radians(0.5 * scene.field_of_view_deg)) / per_px))
    return _remembered(scene, columns, 2.0 * math.degrees(math.atan(0.5 * columns * per_px)))


def _middle(scene: Scene, lens: ThinLens | Pinhole, camera: Camera) -> Scene:
    """Return what of a scene the camera may see, blurred or not, in steps of an eighth of what it sees."""
    seen = seen_pixels(scene, lens, camera)
    beyond_px = seen[0] / camera.width_px * (widest_blur_px(scene, lens, camera) + BEYOND_PX)
    step = max(1.0, seen[0] / 8.0)
    width, height = (math.ceil(step * math.ceil((one + 2.0 * beyond_px) / step)) for one in seen)
    if width >= scene.planes.shape[1] and height >= scene.planes.shape[0]:
        return scene
    return scene.remember(("middle", width, height), lambda: crop_scene(scene, width, height))


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
