"""Executes the motion of sharp layers that shift apart, each as a whole: composited at each instant by one kernel."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Buffer, Device, declared_struct, kernel_source
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import ANY_CFA
from simulator.optics.optics_plan import MOST_SHIFTED_LAYERS, OpticsPlan
from simulator.sensor.camera.camera_sections import Window

SPAN = 64  # photosites of a row and colour of a work-item
FILE = "swept_layers.cl"


def layers_mosaic(optics: OpticsPlan, motion: MotionPlan, device: Device, planes: list[Buffer]) -> Buffer:
    """Device buffer (height, width) float32: `swept_mosaic` of layers for which `OpticsPlan.sweeps_shifted_layers` holds."""
    window, colors = optics.window, optics.cfa.colors
    mosaic = device.empty((window.height, window.width), np.float32)
    _sweep(optics, motion, device, planes, mosaic, window, 1, 2 if len(colors) > 1 else 1, colors[:1])
    return mosaic


def layers_planes(
    optics: OpticsPlan, motion: MotionPlan, device: Device, planes: list[Buffer], window: Window, over: int
) -> Buffer:
    """Device buffer (channels, over * height, over * width) float32: `swept_planes` of such layers."""
    found = device.empty((optics.channels, over * window.height, over * window.width), np.float32)
    _sweep(optics, motion, device, planes, found, window, over, 1, range(optics.channels))
    return found


def _sweep(
    optics: OpticsPlan,
    motion: MotionPlan,
    device: Device,
    planes: list[Buffer],
    mosaic: Buffer,
    window: Window,
    over: int,
    step: int,
    colours: Sequence[int],
) -> None:
    """Write the swept light of a window, `over` samples per photosite and axis, one plane for each of some colours.

    step: columns from one photosite of a span to the next; 2: all colours of a filter in one plane.
    """
    x, y, width, rows, wide = over * window.x, over * window.y, over * window.width, over * window.height, step * SPAN
    aligned, layers = x // wide * wide, optics.covering_layers
    spots, weights = _spots(optics, motion.with_lamps_everywhere(), window, over)
    defines = {
        "SPAN": SPAN,
        "STEP": step,
        "BENDS": 0,
        "LAYERS": layers,
        "MOVING": optics.moving_layers,
        "CHANNELS": optics.channels,
    }
    kernel = device.kernel("swept_layers", {**(optics.cfa_macros() if step == 2 else ANY_CFA), **defines}, file=FILE)
    surfaces = {f"layer_{n}": planes[min(n, layers - 1)] for n in range(MOST_SHIFTED_LAYERS)}
    tables = {"spots": device.upload(spots), "weights": device.upload(weights)}
    for number, colour in enumerate(colours):
        device.run(
            kernel,
            (-(-(x + width - aligned) // wide), step * rows),
            (-(-(x + width - aligned) // wide), 1),
            **surfaces,
            **tables,
            mosaic=mosaic,
            layers={
                "origin_x": x,
                "origin_y": y,
                "width": width,
                "first_column": aligned - x,
                "mosaic_row": number * rows,
                "colour": colour,
                "instants": spots.shape[1],
                "lines": len(spots),
                "over": over,
                "scene_width": optics.projection.scene_width,
                "scene_height": optics.projection.scene_height,
            },
        )
    device.finish()  # the tables are freed on return


def _spots(optics: OpticsPlan, plan: MotionPlan, window: Window, over: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places of layers on each line, (lines or 1, instants, layers) of `struct spot`, and weights of instants.

    Places are counted from the pixel that has the number of the photosite, or sample, that sees them.
    """
    ways, weights = _ways(plan, window, optics.covering_layers)
    places = over * ways + np.array([optics.projection.offset_x, optics.projection.offset_y])
    pixels = np.floor(places)
    found = np.zeros(places.shape[:-1], declared_struct(kernel_source(FILE), "spot"))
    found["column"], found["row"] = np.moveaxis(pixels, -1, 0)
    found["right"], found["below"] = np.moveaxis(places - pixels, -1, 0)
    return found, weights.astype(np.float32)


def _ways(plan: MotionPlan, window: Window, layers: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (lines or 1, instants, layers, 2) x, y [photosites] and weights of instants, in float64."""
    lines = np.zeros(1, np.intp)
    if plan.path.lines.axis == "rows" and not plan.is_common:
        lines = np.clip(np.arange(window.y, window.y + window.height), 0, len(plan.path.lines.peak) - 1)
    path = plan.path.of_lines(lines)
    straight = [way for layer in range(layers) if (way := path.straight_shift(layer)) is not None]
    if len(straight) == layers:
        begin, end = (np.stack(ends, axis=1)[:, None] for ends in zip(*straight, strict=True))
        middles = (np.arange(plan.count) + 0.5) / plan.count
        return begin + middles[:, None, None] * (end - begin), np.full((len(lines), plan.count), 1.0 / plan.count)
    instants = path.of_shift(range(layers)).instants(plan.count)
    return instants.pose_numbers.reshape(*instants.weights.shape, layers, 2), instants.weights
