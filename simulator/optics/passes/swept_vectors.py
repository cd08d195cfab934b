"""Executes the motion of a sharp picture whose pixels move one by one: searches what each photosite sees at each instant."""

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.pixel_vectors import NEAR_PX, STARTS, TILE, PixelVectors
from simulator.optics.geometry.posed_projection import pose_numbers, widest
from simulator.optics.optics_plan import OpticsPlan


def swept_vectors(optics: OpticsPlan, plan: MotionPlan, vectors: PixelVectors, device: Device, planes: Buffer) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance of a sharp picture whose pixels move.

    plan: of the motion. planes: device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1].
    """
    window, projection = optics.window, optics.projection
    instants = plan.window_instants(window)
    homographies = plan.path.motion.homographies(instants.pose_numbers, 0)
    numbers = pose_numbers(plan, homographies)
    own = np.concatenate([instants.weights[..., None], instants.times_s[..., None], numbers], axis=-1)
    columns = instants.axis == "columns"
    lines = window.width if columns else window.height
    poses = np.broadcast_to(own, (lines, *own.shape[1:])).astype(np.float32)
    moving = widest(projection, plan, homographies)
    search = {"TILE": TILE, "STARTS": STARTS, "NEAR_PX": f"{NEAR_PX:.9e}f", "COLUMNS": int(columns)}
    defines = {**moving.defines(optics.cfa_macros(), inset=0.5 * (1.0 - projection.open_side)), **search}
    mosaic = device.empty((window.height, window.width), np.float32)
    clock_s = plan.path.start_s + plan.path.times_s[[0, -1]]
    device.run(
        device.kernel("swept_vectors", defines, file="swept_vectors.cl"),
        (window.width, window.height),
        None,
        planes=planes,
        vectors=device.upload(vectors.table()),
        starts=device.upload(vectors.starts(float(clock_s[0]), float(clock_s[1]))),
        poses=device.upload(poses),
        mosaic=mosaic,
        sweep={
            "origin_x": window.x,
            "origin_y": window.y,
            "instants": instants.count,
            "scene_width": projection.scene_width,
            "scene_height": projection.scene_height,
            "scale": projection.scale,
            "offset_x": projection.offset_x,
            "offset_y": projection.offset_y,
            "rests": projection.rests(),
        },
    )
    device.finish()  # the tables are freed on return
    return mosaic
