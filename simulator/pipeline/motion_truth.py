"""Truth of what moves: the camera's pose in the middle of a frame's exposure, and the flow from there to the next frame's."""

from collections.abc import Sequence

import numpy as np

from simulator.errors import require
from simulator.exposure.line_times import LineTimes
from simulator.exposure.mid_exposure import mid_exposure_s
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.image_motion import plan_geometry
from simulator.optics.geometry.projection import Projection
from simulator.pipeline.shot import Shot
from simulator.pipeline.truth_maps import centres_px
from simulator.scene.scene import Scene
from simulator.sensor.camera.readout_window import ReadoutGeometry


def flow_map(
    shot: Shot, scene: Scene, projection: Projection, layout: ReadoutGeometry, openings: Sequence[LineTimes]
) -> np.ndarray:
    """Return how far what each pixel's centre sees moves until the next frame, (height, width, 2) float32 [frame's pixels].

    From the middle of the pixel's own exposure to that of the line where it is then, `Motion.flow_time_s` later; x to the
    right, y down. Of the first surface that covers more than half, whether it is in focus or not. NaN where the camera moves
    past it.
    openings: of the shutter, from the release on.
    Raises PhotositeError for a lens that forms no image, and for a path that ends before.
    """
    from simulator.optics.geometry.surface_flow import SurfaceFlow  # not needed for the pose

    frame, motion = layout.computed, shot.motion or Motion()
    require(shot.lens.forms_image, "truth", "flow", "this lens forms no image that could move; leave flow out")
    geometry = plan_geometry(shot.lens, shot.camera, projection)
    middle_s = shot.exposure.start_s + mid_exposure_s(openings)
    field = motion.vector_field((scene.planes.shape[0], scene.planes.shape[1]), scene.window)
    velocity = None if field is None else field.px_per_s(scene.depth_m, geometry.scale * geometry.image_distance_px)
    flow = SurfaceFlow(scene, motion, geometry, projection.warp, velocity)
    before, after = (flow.poses(openings[0].axis, times_s) for times_s in (middle_s, middle_s + (motion.flow_after_s or 0.0)))
    factor = 1 if layout.binning is None else layout.binning.factor
    across, down = (centres_px(count, factor, layout.filter_step) for count in (layout.binned.width, layout.binned.height))
    x, y = np.meshgrid(frame.x + across, frame.y + down)
    kept = layout.kept
    places = np.column_stack([x[kept].ravel(), y[kept].ravel()])
    found = flow.displacements(before, after, places) / factor
    return found.reshape(*x[kept].shape, 2).astype(np.float32)


def pose_facts(exposure: Exposure, motion: Motion | None, openings: Sequence[LineTimes]) -> dict[str, object]:
    """Return clock and pose of the camera in the middle of the exposure, plain data for the JSON beside a raw file.

    mid_exposure_s: on the shot's clock, of the mean over all lines. rotation_deg: tilt, pan and roll, see `Poses`.
    location_m: of the lens's centre, right, up and back. Both relative to the camera when the clock is 0. openings: of the
    shutter, from the release on.
    Raises PhotositeError for a path that ends before.
    """
    middle_s = exposure.start_s + float(np.mean(mid_exposure_s(openings)))
    pose = (motion or Motion()).camera_poses(np.array([middle_s]))
    turned, moved = np.degrees(pose.rotation_rad[0]), pose.location_m[0]
    return {"mid_exposure_s": middle_s, "rotation_deg": list(map(float, turned)), "location_m": list(map(float, moved))}
