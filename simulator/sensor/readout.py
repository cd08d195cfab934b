"""Passes between and around the parts of the fused kernel: crosstalk, binning and optical black."""

from collections.abc import Callable

import numpy as np
from numpy.typing import DTypeLike

from simulator.device import Buffer, Device
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.readout_window import ReadoutGeometry
from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, launch_sensor
from simulator.sensor.kernel.noise_free import code_of_charge, code_of_light, mean_charge, mean_electrons
from simulator.sensor.seeds import Seeds
from simulator.sensor.sensor_plan import SensorPlan


def read_out(device: Device, sensor: SensorPlan, mosaic: Buffer, seeds: Seeds) -> np.ndarray:
    """Return the codes (height, width) uint16 for a mosaic of electron radiance, binned and cropped to the output window."""
    geometry = sensor.readout
    frame = geometry.computed
    if not geometry.shares_charge and not geometry.averages:
        setting = [FrameSetting(sensor.stages, seeds, frame.x, frame.y)]

        def launch(result: Buffer) -> None:
            launch_sensor(device, mosaic, result, (frame.height, frame.width), setting, KernelPart.WHOLE)

        return _receive(device, geometry, launch, np.uint16)
    binned = geometry.binned
    parts: list[tuple[KernelPart, Window, DTypeLike]] = [(KernelPart.WHOLE, frame, np.uint16)]
    if geometry.shares_charge:
        parts = [(KernelPart.CHARGE, frame, np.float32), (KernelPart.READOUT, geometry.read, np.uint16)]
    signal = mosaic
    for part, window, dtype in parts:
        shape, source = (window.height, window.width), signal
        signal = device.empty(shape, dtype)
        launch_sensor(device, source, signal, shape, [FrameSetting(sensor.stages, seeds, window.x, window.y)], part)
        if part is KernelPart.CHARGE:
            signal = share_charge(device, geometry, signal)
    if geometry.averages:
        signal = _bin(device, geometry, "codes", signal, np.uint16)
    return device.download(signal, (binned.height, binned.width), np.uint16)[geometry.kept]


def read_mean_electrons(device: Device, sensor: SensorPlan, light: Buffer) -> np.ndarray:
    """Return the mean electrons [e-] of the frame's pixels, (height, width) float32; light: mosaic of electron radiance."""
    geometry, frame = sensor.readout, sensor.readout.computed
    shape, setting = (frame.height, frame.width), [FrameSetting(sensor.stages, x=frame.x, y=frame.y)]
    if not geometry.shares_charge and not geometry.averages:
        return _receive(device, geometry, lambda result: mean_electrons(device, light, result, shape, setting), np.float32)
    electrons = device.empty(shape, np.float32)
    mean_electrons(device, light, electrons, shape, setting)
    return download_averaged(device, geometry, share_charge(device, geometry, electrons))[geometry.kept]


def read_noise_free(device: Device, sensor: SensorPlan, light: Buffer) -> np.ndarray:
    """Return the codes without noise [DN] of the frame's pixels, (height, width) float32; light: as `read_mean_electrons`."""
    geometry, frame, read = sensor.readout, sensor.readout.computed, sensor.readout.read
    shape, setting = (frame.height, frame.width), [FrameSetting(sensor.stages, x=frame.x, y=frame.y)]
    if not geometry.shares_charge and not geometry.averages:
        return _receive(device, geometry, lambda result: code_of_light(device, light, result, shape, setting), np.float32)
    charge = device.empty(shape, np.float32)
    mean_charge(device, light, charge, shape, setting)
    signal = share_charge(device, geometry, charge)
    code_of_charge(device, signal, (read.height, read.width), setting)
    return download_averaged(device, geometry, signal)[geometry.kept]


def _receive(device: Device, geometry: ReadoutGeometry, launch: Callable[[Buffer], None], dtype: DTypeLike) -> np.ndarray:
    """Return what a launch writes for the computed photosites, cropped to the output window.

    The result is an array of its own: kernels write into it on a CPU, so that its memory is neither copied nor mapped twice.
    """
    array = np.empty((geometry.computed.height, geometry.computed.width), dtype)
    result = device.receive(array)
    launch(result)
    device.collect(result, array)
    return array[geometry.kept]


def darken_optical_black(device: Device, mosaic: Buffer, window: Window, active: Window) -> None:
    """Set a mosaic to 0, in place, outside the active area of the sensor.

    mosaic: (height, width) float32 of electron radiance. window: area of the sensor that it covers.
    """
    edges = {
        "left": active.x,
        "top": active.y,
        "right": active.x + active.width,
        "bottom": active.y + active.height,
    }
    kernel = device.kernel("optical_black", {})
    device.run(kernel, (window.width, window.height), None, mosaic=mosaic, window_x=window.x, window_y=window.y, **edges)


def share_with_neighbors(device: Device, source: Buffer, window: Window, shares: tuple[float, float]) -> Buffer:
    """Return a signal (height, width) float32 after crosstalk.

    source: signal before it. shares: share that goes to each of the four direct and of the four diagonal neighbours.
    """
    result = device.empty((window.height, window.width), np.float32)
    side, corner = shares
    device.run(
        device.kernel("crosstalk", {}),
        (window.width, window.height),
        None,
        input=source,
        mixed=result,
        side=side,
        corner=corner,
    )
    return result


def share_charge(device: Device, geometry: ReadoutGeometry, charge: Buffer) -> Buffer:
    """Return the charge [e-] that is read out: after electrical crosstalk, and summed over binned photosites."""
    if any(geometry.crosstalk.electrical_shares):
        charge = share_with_neighbors(device, charge, geometry.computed, geometry.crosstalk.electrical_shares)
    return _bin(device, geometry, "electrons", charge, np.float32) if geometry.adds_charge else charge


def download_averaged(device: Device, geometry: ReadoutGeometry, signal: Buffer) -> np.ndarray:
    """Download a float32 signal, averaged over binned photosites where the camera averages codes."""
    frame = geometry.binned
    if geometry.binning is None or not geometry.averages:
        return device.download(signal, (frame.height, frame.width), np.float32)
    sums = _bin(device, geometry, "electrons", signal, np.float32)
    return device.download(sums, (frame.height, frame.width), np.float32) / np.float32(geometry.binning.count)


def _bin(device: Device, geometry: ReadoutGeometry, what: str, source: Buffer, dtype: DTypeLike) -> Buffer:
    """Return the computed photosites binned. what: "electrons", which are summed, or "codes", which are averaged."""
    frame, binning = geometry.binned, geometry.binning
    assert binning is not None  # called only for cameras that bin
    result = device.empty((frame.height, frame.width), dtype)
    kernel = device.kernel(f"bin_{what}", {"FACTOR": binning.factor, "STEP": geometry.filter_step}, file="binning.cl")
    arguments = {what: source, f"binned_{what}": result, "width": geometry.computed.width}
    device.run(kernel, (frame.width, frame.height), None, **arguments)
    return result
