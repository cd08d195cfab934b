"""Executes the sensor: the fused kernel tile by tile in the variant that each tile needs, and the passes between neighbours."""

from enum import IntEnum

import numpy as np

from simulator import tiles
from simulator.device import Device
from simulator.fused import sensor_defines
from simulator.planner import Plan
from simulator.sensor.camera_sections import Window
from simulator.sensor.poisson_means import PoissonMeans, poisson_means
from simulator.shot import Seeds


class Part(IntEnum):
    """Part of the fused kernel, as kernels/sensor.cl numbers them."""

    WHOLE = 0
    CHARGE = 1
    READOUT = 2


def read_out(planned: Plan, device: Device, mosaic, seeds: Seeds) -> np.ndarray:
    """Codes (height, width) uint16 of a mosaic of electron radiance, binned and cut to what the camera gives out."""
    layout = planned.layout
    frame, binned = layout.computed, layout.binned
    if layout.shares_charge:
        charge = device.empty((frame.height, frame.width), np.float32)
        sense(planned, device, mosaic, charge, seeds, Part.CHARGE, frame)
        charge = shared_charge(planned, device, charge)
        window = layout.read
        codes = device.empty((window.height, window.width), np.uint16)
        sense(planned, device, charge, codes, seeds, Part.READOUT, window)
    else:
        codes = device.empty((frame.height, frame.width), np.uint16)
        sense(planned, device, mosaic, codes, seeds, Part.WHOLE, frame)
    if layout.averages:
        codes = _binned(planned, device, "codes", codes, np.uint16)
    return device.download(codes, (binned.height, binned.width), np.uint16)[layout.kept]


def sense(planned: Plan, device: Device, source, result, seeds: Seeds, part: Part, window: Window) -> None:
    """Enqueue the fused kernel, for each tile the variant that can count the electrons expected there.

    Which variant a tile gets changes its speed, never its codes. window: the frame on the sensor that source and result hold.
    """
    defines, parameters = sensor_defines(planned.stages)
    columns = tiles.edges(window.width, device.row_px)
    rows = tiles.pair_edges(window.y, window.height, tiles.TILE_HEIGHT)
    shape = (len(rows) - 1, len(columns) - 1)
    counts = part is not Part.READOUT
    means = _poisson_means(planned, device, source, columns, rows) if counts else np.full(shape, PoissonMeans.LARGE)
    buffer = device.upload(parameters)
    pair_rows = tiles.rows_of_pairs(window.y, rows)
    for variant in np.unique(means):
        for mask in np.unique(pair_rows):
            wanted = (means == variant) & (pair_rows == mask)[:, np.newaxis]
            macros = {**defines, "POISSON_MEANS": int(variant), "ROWS": int(mask), "PART": int(part)}
            for (width, height), corners in tiles.group_by_shape(columns, rows, wanted).items():
                device.run(
                    device.kernel("sensor", macros),
                    (width, -(-height // 2), len(corners)),
                    (width, 1, 1),
                    input=source,
                    output=result,
                    tiles=device.upload(corners),
                    parameters=buffer,
                    width=window.width,
                    window_x=window.x,
                    window_y=window.y,
                    frame_seed=seeds.frame,
                    body_seed=seeds.body,
                )


def covered(planned: Plan, device: Device, mosaic):
    """Mosaic of electron radiance with the optical black darkened; the same buffer, as it is when all of it sees light."""
    frame, lit = planned.frame, planned.layout.lit
    edges = {"left": lit.x, "top": lit.y, "right": lit.x + lit.width, "bottom": lit.y + lit.height}
    begins = lit.x <= frame.x and lit.y <= frame.y
    if not (begins and frame.x + frame.width <= edges["right"] and frame.y + frame.height <= edges["bottom"]):
        kernel = device.kernel("optical_black", {})
        device.run(kernel, (frame.width, frame.height), None, mosaic=mosaic, window_x=frame.x, window_y=frame.y, **edges)
    return mosaic


def mixed(planned: Plan, device: Device, source, shares: tuple[float, float]):
    """Buffer after a pass of crosstalk; the same buffer when nothing is shared."""
    if shares == (0.0, 0.0):
        return source
    frame = planned.frame
    result = device.empty((frame.height, frame.width), np.float32)
    side, corner = shares
    device.run(
        device.kernel("crosstalk", {}), (frame.width, frame.height), None, input=source, mixed=result, side=side, corner=corner
    )
    return result


def shared_charge(planned: Plan, device: Device, charge):
    """Charge [e-] as it is read: what neighbours see of each other, and binned photosites added up."""
    charge = mixed(planned, device, charge, planned.layout.crosstalk.electrical_shares)
    return _binned(planned, device, "electrons", charge, np.float32) if planned.layout.adds_charge else charge


def averaged(planned: Plan, device: Device, signal):
    """Array of a float32 signal; its means where the camera averages codes."""
    frame = planned.layout.binned
    if not planned.layout.averages:
        return device.download(signal, (frame.height, frame.width), np.float32)
    sums = _binned(planned, device, "electrons", signal, np.float32)
    return device.download(sums, (frame.height, frame.width), np.float32) / np.float32(planned.layout.binning.count)


def _binned(planned: Plan, device: Device, what: str, source, dtype):
    frame, binning = planned.layout.binned, planned.layout.binning
    result = device.empty((frame.height, frame.width), dtype)
    kernel = device.kernel(f"bin_{what}", {"FACTOR": binning.factor, "STEP": planned.layout.filter_step}, file="binning.cl")
    arguments = {what: source, f"binned_{what}": result, "width": planned.frame.width}
    device.run(kernel, (frame.width, frame.height), None, **arguments)
    return result


def _poisson_means(planned: Plan, device: Device, mosaic, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Variant of kernels/poisson.h for each tile: (tile rows, tile columns) of PoissonMeans."""
    shape = (len(rows) - 1, len(columns) - 1)
    if planned.stage("photon_shot_noise") is None:
        return np.full(shape, PoissonMeans.LARGE)
    range_shape = (2, shape[0], planned.frame.width)
    extremes = device.empty(range_shape, np.float32)
    edges = device.upload(rows.astype(np.uint32))
    kernel = device.kernel("tile_range", {"TILE_HEIGHT": tiles.TILE_HEIGHT})
    device.run(kernel, range_shape[:0:-1], None, image=mosaic, range=extremes, edges=edges)
    least, greatest = device.download(extremes, range_shape, np.float32)
    darkest, brightest = planned.electrons_per_radiance()
    least_e = np.minimum.reduceat(least, columns[:-1], axis=1) * darkest
    greatest_e = np.maximum.reduceat(greatest, columns[:-1], axis=1) * brightest
    return poisson_means(least_e, greatest_e)
