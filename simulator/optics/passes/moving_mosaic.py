"""Executes the motion of an image: swept by one kernel, or as the weighted sum of the planned optics at each instant."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.posed_projection import posed
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.layer_cells import cells_mosaic
from simulator.optics.passes.still_mosaic import still_mosaic
from simulator.optics.passes.swept_layers import points_mosaic
from simulator.optics.passes.swept_mosaic import swept_mosaic
from simulator.optics.passes.swept_vectors import swept_vectors
from simulator.optics.passes.tile_plan import plan_tiles
from simulator.sensor.camera.camera_sections import Window


def moving_mosaic(optics: OpticsPlan, device: Device, planes: list[Buffer], progress: Callable[[float], None]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance of a scene that moves, mean over the exposure.

    planes: a device buffer for each layer, as for `defocused_mosaic`.
    """
    plan = optics.motion
    assert plan is not None  # without it this pass does not run
    if plan.vectors is not None:
        return swept_vectors(optics, plan, plan.vectors, device, planes[0])
    if plan.method == "swept":
        return swept_mosaic(optics, device, planes)
    if plan.method == "joint":  # the blur carries it
        assert optics.defocus is not None and optics.joint is not None  # they are planned together
        blur = replace(optics.defocus, motion=replace(optics.joint, path=plan.path))
        if optics.samples_shifted_layers:
            means, find, count = points_mosaic(optics, blur, plan, device, planes, progress)
            return cells_mosaic(optics, find, count, device, planes, means) if optics.mixes_points else means
        joint = replace(optics, motion=None, flash_motion=None, defocus=blur)
        return still_mosaic(joint, plan_tiles(joint, device), device, planes, progress)
    return _sum_of_instants(optics, plan, device, planes, progress)


def _sum_of_instants(
    optics: OpticsPlan, plan: MotionPlan, device: Device, planes: list[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Run the optics at each instant, over the lines that it lights."""
    window, axis = optics.window, plan.path.lines.axis
    homographies, weights = _weighted_poses(plan, window)
    total = device.zeros((window.height, window.width), np.float32)
    kernel = device.kernel("weighted_light", {"COLUMNS": int(axis == "columns")})
    lit = np.flatnonzero(weights.any(axis=0)).tolist()
    for done, instant in enumerate(lit):
        own = weights[:, instant]
        rows = np.flatnonzero(own) if axis == "rows" else np.array([0, window.height - 1])
        first, count = int(rows[0]), int(rows[-1] - rows[0]) + 1
        part = Window(window.x, window.y + first, window.width, count)
        projection = posed(optics.projection, plan, homographies[instant], optics.accuracy.allowed)
        there = replace(optics, window=part, motion=None, projection=projection)
        light = still_mosaic(there, plan_tiles(there, device), device, planes, lambda share: None)
        lines = np.broadcast_to(own, window.height) if axis == "all" else own
        device.run(
            kernel,
            (window.width, count),
            None,
            light=light,
            sum=total,
            weights=device.upload(lines.astype(np.float32)),
            first_row=first,
        )
        device.finish()  # the image of this instant is freed before the next
        progress((done + 1) / len(lit))
    return total


def _weighted_poses(plan: MotionPlan, window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Return homographies of all instants (instants, 3, 3) and weights on the window's lines (lines or 1, instants).

    Where all lines are open at once the instants are theirs; else nodes that all lines share.
    """
    path = plan.path
    if plan.is_common:
        instants = path.of_lines(np.zeros(1, np.intp)).instants(plan.count)
        lines = {"all": 1, "rows": window.height, "columns": window.width}[path.lines.axis]
        weights = np.broadcast_to(instants.weights, (lines, plan.count))
        return path.motion.homographies(instants.pose_numbers[0], 0), weights
    nodes_s = plan.shared_nodes()
    first, size = (window.x, window.width) if path.lines.axis == "columns" else (window.y, window.height)
    weights = path.of_lines(np.arange(first, first + size)).node_weights(nodes_s)
    numbers = path.motion.pose_numbers(path.start_s + nodes_s)
    return path.motion.homographies(numbers, 0), weights
