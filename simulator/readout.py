"""Executes the sensor for one shot: the fused kernel, and the passes around it."""

import numpy as np

from simulator.device import Device
from simulator.fused import sensor_defines
from simulator.lens import Irradiance
from simulator.planner import Plan
from simulator.sensing import FrameSetting, Part, sense
from simulator.shot import Seeds

LEAST_OPEN = 1e-4  # of the light on the axis: where rims let less through, scattered light fades as the image does


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


def veiled(planned: Plan, device: Device, mosaic):
    """Mosaic of electron radiance with the light that the lens scatters; the same buffer, as it is without scattered light."""
    glare, frame = planned.veiling_glare, planned.frame
    if glare is not None:
        stage = planned.stage(Irradiance.stem)
        defines, numbers = sensor_defines((stage,))
        lens = {name: value for name, value in defines.items() if name.startswith(stage.stem.upper())}
        device.run(
            device.kernel("veiling_glare", lens | planned.filter_macros()),
            (frame.width, frame.height),
            None,
            mosaic=mosaic,
            veil=device.upload(glare.irradiance.astype(np.float32)),
            parameters=device.upload(numbers),
            window_x=frame.x,
            window_y=frame.y,
            image_share=1.0 - glare.share,
            least_open=LEAST_OPEN * stage.solid_angle_sr,
        )
    return mosaic


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
