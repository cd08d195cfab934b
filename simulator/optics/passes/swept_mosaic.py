"""Executes the motion of a sharp image: sweeps each surface along its path, composited front to back at each instant."""

from typing import Any

import numpy as np

from simulator.device import Buffer, Device, declared_struct, kernel_source
from simulator.optics.geometry.instants import Instants
from simulator.optics.geometry.motion_plan import MotionPlan, pose_numbers, row_views
from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_plan import OpticsPlan

SPAN = 64  # photosites of a row and colour that share a parabola of displacements, on every device, for the same bits
FILE = "swept_projection.cl"
OPEN_BYTES = 2**22  # of the light that nearer layers let through, while a band of rows is computed
EVEN_DRIFT = 0.9  # photosites by which the span's reading may drift, where it reads adjacent pixels


def swept_mosaic(optics: OpticsPlan, device: Device, planes: list[Buffer]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance of a sharp scene that moves.

    planes: for each layer a device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1]; with the layer's
    coverage as one plane more where any layer of the scene has one.
    """
    window, plan = optics.window, _plan_of(optics)
    instants = plan.window_instants(window)
    mosaic, layers = device.empty((window.height, window.width), np.float32), optics.covering_layers
    aligned = window.x // (2 * SPAN) * 2 * SPAN
    spans = -(-(window.x + window.width - aligned) // (2 * SPAN))
    set_columns, rows = spans * SPAN, window.height
    if layers > 1:
        rows = min(rows, max(OPEN_BYTES // (8 * set_columns * instants.count), 1))
    open_ = device.empty((instants.count, rows, 2, set_columns) if layers > 1 else (1,), np.float32)
    tables = [_table(optics, instants, layer, device) for layer in range(layers)]
    for first_row in range(0, window.height, rows):
        count = min(rows, window.height - first_row)
        for layer in range(layers):
            name, table, macros = tables[layer]
            at_rest = int(plan.path.motion.is_at_rest(layer))
            defines = {**macros, "FIRST": int(layer == 0), "COVERED": int(layer < layers - 1), "AT_REST": at_rest}
            device.run(
                device.kernel(name, defines, file=FILE),
                (spans, 2 * count),
                (spans, 1),
                planes=planes[layer],
                open=open_,
                mosaic=mosaic,
                sweep={
                    **_geometry(optics.projection),
                    "origin_x": window.x,
                    "origin_y": window.y,
                    "width": window.width,
                    "first_column": aligned - window.x,
                    "first_row": first_row,
                    "set_columns": set_columns,
                    "instants": instants.count,
                    "pivot_x": 0.5 * optics.sensor_px[0],
                    "pivot_y": 0.5 * optics.sensor_px[1],
                },
                **table,
            )
    device.finish()  # the tables are freed on return
    return mosaic


def _table(
    optics: OpticsPlan, instants: Instants, layer: int, device: Device
) -> tuple[str, dict[str, Buffer], dict[str, object]]:
    """Return the kernel for a layer, its table of displacements and its macros."""
    window, plan, projection = optics.window, _plan_of(optics), optics.projection
    homographies = plan.path.motion.homographies(instants.pose_numbers, layer)
    inset = 0.5 * (1.0 - projection.open_side)
    moving = Projection(**{**vars(projection), "pose": (0.0,) * 10})
    macros = moving.defines(optics.cfa_macros(), inset=inset)
    columns = instants.axis == "columns"
    common: dict[str, object] = {"SPAN": SPAN, "COLUMNS": int(columns), "CHANNELS": optics.channels, "EVEN": 0}
    lines = window.width if columns else window.height
    if columns or not optics.sweeps_rows:
        numbers = np.concatenate([instants.weights[..., None], pose_numbers(plan, homographies)], axis=-1)
        table = np.broadcast_to(numbers, (lines, *numbers.shape[1:])).astype(np.float32)
        return "swept_places", {"poses": device.upload(table)}, {**macros, **common, "BUFFER": 4, "READS": 2}
    views = row_views(plan, homographies, range(window.y, window.y + window.height))
    fields = np.zeros((lines, instants.count), declared_struct(kernel_source(FILE), "view"))
    for name, values in {**views, "weight": instants.weights}.items():
        fields[name] = values
    taps = moving.taps(projection.open_side)
    drift = (2 * SPAN - 2) * (abs(projection.scale - 1.0) + plan.slopes[1])
    common |= {
        "EVEN": int(taps == 0 and drift < EVEN_DRIFT),
        "READS": taps or 2,
        "BUFFER": int(np.ceil(1.1 * (2 * SPAN - 2) * projection.scale)) + taps + 6,
    }
    return "swept_rows", {"views": device.upload(fields)}, {**macros, **common, "TAPS": taps, "POSE": 0}


def _geometry(projection: Projection) -> dict[str, Any]:
    names = "scene_width", "scene_height", "scale", "offset_x", "offset_y"
    return {name: getattr(projection, name) for name in names}


def _plan_of(optics: OpticsPlan) -> MotionPlan:
    """The planned motion, without which this pass does not run."""
    assert optics.motion is not None
    return optics.motion
