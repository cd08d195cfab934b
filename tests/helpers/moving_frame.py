"""Frames of moving scenes: what the simulator makes of them, and the mean of very many instants in float64."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from simulator.device import open_device
from simulator.exposure.camera_motion import CameraPath
from simulator.exposure.exposed_light import LightComponent
from simulator.exposure.light_curve import SteadyLight
from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.optics.defocus.mixed_edges import LayerEdges
from simulator.optics.geometry.motion_plan import Timing
from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_planning import plan_optics
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot

TOGETHER = 160  # instants of a mean that are read at a time


def plan_moving(shot: Shot, lines: LineTimes | None = None) -> Plan:
    """Plan of a shot whose lines are open at these times."""
    planned, exposure = plan(replace(shot, motion=None)), shot.exposure
    assert shot.motion is not None
    openings = (open_at_once(exposure.time_s) if lines is None else lines,)
    component = LightComponent(False, SteadyLight(), openings, exposure.start_s, exposure.time_s)
    timing = Timing(shot.motion, (component,))
    return replace(planned, optics=plan_optics(shot.scene.load(), shot.lens, planned.sensor, shot.tolerance, timing))


def moving_light(planned: Plan) -> np.ndarray:
    """Mosaic of a plan, (height, width) float64, in units of the scene's plane weights."""
    device = open_device()
    window = planned.optics.window
    light = device.download(expose(measure(planned, device), device), (window.height, window.width), np.float32)
    return light.astype(np.float64) / float(planned.optics.weights.max())


def without_edges(planned: Plan) -> Plan:
    """Plan of layers whose means over photosites are composited, also where their edges cross photosites."""
    optics = replace(planned.optics)
    vars(optics)["layer_edges"] = LayerEdges({}, 0.0)
    return replace(planned, optics=optics)


def rolling(rows: int, time_s: float, row_s: float) -> LineTimes:
    """Times of an electronic shutter that opens one row after the other."""
    opens = row_s * np.arange(rows)
    return LineTimes("rows", opens, opens, opens + time_s, opens + time_s, np.ones(rows))


def places_seen(
    camera: CameraPath, time_s: np.ndarray, x: np.ndarray, y: np.ndarray, distance_px: float, depth_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places at rest that places x, y on the sensor [photosites from the axis] see at some times, by rays through space.

    Times and places may have any shapes that broadcast.
    """
    pose = camera.poses(np.ravel(time_s))
    turns = Rotation.from_euler("xyz", pose.rotation_rad).as_matrix().reshape(*np.shape(time_s), 3, 3)
    met = [turns[..., axis, 0] * x - turns[..., axis, 1] * y - turns[..., axis, 2] * distance_px for axis in range(3)]
    if not np.isfinite(depth_m):
        return distance_px * met[0] / -met[2], -distance_px * met[1] / -met[2]
    from_m = pose.location_m.reshape(*np.shape(time_s), 3)
    along = (-depth_m - from_m[..., 2]) / met[2]
    at = [(from_m[..., axis] + along * met[axis]) / depth_m for axis in (0, 1)]
    return distance_px * at[0], -distance_px * at[1]


def seen_at(picture: np.ndarray, u: np.ndarray, v: np.ndarray, side: float) -> np.ndarray:
    """Mean of a picture that is bilinear between its pixels over squares of this side around (u, v) [px from the first pixel].

    Between the lines on which it bends, light is linear along either axis, so that its value at the middle is the mean.
    """
    picture = np.asarray(picture, np.float64)
    if side == 0.0:
        return map_coordinates(picture, (v, u), order=1, mode="nearest")

    def parts(middle: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        low, high, bend = middle - 0.5 * side, middle + 0.5 * side, np.rint(middle)  # a line bends at pixels alone
        bend = np.clip(bend, low, high)
        return [(0.5 * (low + bend), (bend - low) / side), (0.5 * (bend + high), (high - bend) / side)]

    pairs = [(*down, *right) for down in parts(v) for right in parts(u)]
    return np.sum(
        [tall * wide * map_coordinates(picture, (y, x), order=1, mode="nearest") for y, tall, x, wide in pairs], axis=0
    )


def dense_mean(
    pictures: Sequence[tuple[np.ndarray, np.ndarray | None, float]],
    camera: CameraPath,
    projection: Projection,
    sensor: tuple[int, int],
    distance_px: float,
    opens_s: np.ndarray,
    time_s: float,
    instants: int = 160,
) -> np.ndarray:
    """Mean over dense instants of layers (light, coverage, depth), read bilinearly at the centre of each photosite.

    Where the scene has fewer pixels than photosites it is the mean over the photosite.
    sensor: rows, columns. opens_s: (rows,). Returns (rows, columns) float64.
    """
    y, x = (np.arange(count) + 0.5 - 0.5 * count for count in sensor)
    total, side = np.zeros(sensor), projection.scale * projection.is_bilinear
    for parts in np.array_split((np.arange(instants) + 0.5) / instants, -(-instants // TOGETHER)):
        time = opens_s[:, None] + time_s * parts[:, None, None]  # (instants, rows, 1)
        light, through = np.zeros((len(parts), *sensor)), np.ones((len(parts), *sensor))
        for picture, coverage, depth_m in pictures:
            right, down = places_seen(camera, time, x, y[:, None], distance_px, depth_m)
            u = projection.offset_x + projection.scale * (right + 0.5 * sensor[1]) - 0.5
            v = projection.offset_y + projection.scale * (down + 0.5 * sensor[0]) - 0.5
            light += through * seen_at(picture, u, v, side)
            if coverage is not None:
                through *= 1.0 - seen_at(coverage, u, v, side)
        total += light.sum(axis=0) / instants
    return total
