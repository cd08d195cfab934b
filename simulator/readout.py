"""Executes the sensor for one shot: the fused kernel, and the passes between neighbours."""

import numpy as np

from simulator.device import Device
from simulator.planner import Plan
from simulator.sensing import FrameSetting, Part, sense
from simulator.shot import Seeds


def read_out(planned: Plan, device: Device, mosaic, seeds: Seeds) -> np.ndarray:
    """Codes (height, width) uint16 of a mosaic of electron radiance, binned and cut to what the camera gives out."""
    layout = planned.layout
    frame, binned = layout.computed, layout.binned
    parts = [(Part.WHOLE, frame, np.uint16)]
    if layout.shares_charge:
        parts = [(Part.CHARGE, frame, np.float32), (Part.READOUT, layout.read, np.uint16)]
    signal = mosaic
    for part, window, dtype in parts:
        shape, source = (window.height, window.width), signal
        signal = device.empty(shape, dtype)
        sense(device, source, signal, shape, [FrameSetting(planned.stages, seeds, window.x, window.y)], part)
        if part is Part.CHARGE:
            signal = shared_charge(planned, device, signal)
    if layout.averages:
        signal = _binned(planned, device, "codes", signal, np.uint16)
    return device.download(signal, (binned.height, binned.width), np.uint16)[layout.kept]


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
