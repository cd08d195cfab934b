"""Passes between and around the parts of the fused kernel: crosstalk, blooming, binning, remosaic and optical black."""

from collections.abc import Callable

import numpy as np
from numpy.typing import DTypeLike

from simulator.device import Buffer, Device
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.readout_window import ReadoutGeometry
from simulator.sensor.camera.remosaic import remosaic_weights
from simulator.sensor.code_variance import map_moments
from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, launch_sensor, tile_extremes
from simulator.sensor.kernel.kernel_program import MOST_ELECTRONS
from simulator.sensor.kernel.noise_free import code_of_charge, code_of_light, mean_charge, mean_electrons
from simulator.sensor.kernel.tiles import TILE_HEIGHT
from simulator.sensor.seeds import Seeds
from simulator.sensor.sensor_plan import SensorPlan
from simulator.sensor.stages.stage import Moments

STEPS_AT_ONCE = 16  # of blooming, before it is looked at whether any charge still moves


def read_out(device: Device, sensor: SensorPlan, mosaic: Buffer, seeds: Seeds) -> np.ndarray:
    """Return the codes (height, width) uint16 for a mosaic of electron radiance, binned and cropped to the output window."""
    geometry = sensor.readout
    frame = geometry.computed
    if geometry.is_plain:
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
        stages = sensor.spilling_stages if part is KernelPart.CHARGE else sensor.stages
        launch_sensor(device, source, signal, shape, [FrameSetting(stages, seeds, window.x, window.y)], part)
        if part is KernelPart.CHARGE:
            spill_charge(device, sensor, signal)
            signal = share_charge(device, geometry, signal)
    if geometry.averages:
        signal = _bin(device, geometry, "codes", signal, np.uint16)
    if geometry.pattern is not None:
        signal = _remosaic(device, geometry, geometry.pattern, "codes", signal, {"white_dn": sensor.adc_range[1]})
    return device.download(signal, (binned.height, binned.width), np.uint16)[geometry.kept]


def read_mean_electrons(device: Device, sensor: SensorPlan, light: Buffer) -> np.ndarray:
    """Return the mean electrons [e-] of the frame's pixels, (height, width) float32; light: mosaic of electron radiance."""
    geometry, frame = sensor.readout, sensor.readout.computed
    shape, setting = (frame.height, frame.width), [FrameSetting(sensor.stages, x=frame.x, y=frame.y)]
    if geometry.is_plain:
        return _receive(device, geometry, lambda result: mean_electrons(device, light, result, shape, setting), np.float32)
    electrons = device.empty(shape, np.float32)
    mean_electrons(device, light, electrons, shape, setting)
    electrons = share_charge(device, geometry, electrons)
    if geometry.pattern is not None:
        electrons = _remosaic(device, geometry, geometry.pattern, "signal", electrons, {"most": MOST_ELECTRONS})
    return download_averaged(device, geometry, electrons)[geometry.kept]


def read_noise_free(device: Device, sensor: SensorPlan, light: Buffer) -> np.ndarray:
    """Return the codes without noise [DN] of the frame's pixels, (height, width) float32; light: as `read_mean_electrons`."""
    geometry, frame, read = sensor.readout, sensor.readout.computed, sensor.readout.read
    shape, setting = (frame.height, frame.width), [FrameSetting(sensor.stages, x=frame.x, y=frame.y)]
    if geometry.is_plain:
        return _receive(device, geometry, lambda result: code_of_light(device, light, result, shape, setting), np.float32)
    charge = device.empty(shape, np.float32)
    mean_charge(device, light, charge, shape, [FrameSetting(sensor.spilling_stages, x=frame.x, y=frame.y)])
    spill_charge(device, sensor, charge)
    signal = share_charge(device, geometry, charge)
    code_of_charge(device, signal, (read.height, read.width), setting)
    if geometry.pattern is not None:
        signal = _remosaic(device, geometry, geometry.pattern, "signal", signal, {"most": float(sensor.adc_range[1])})
    return download_averaged(device, geometry, signal)[geometry.kept]


def spill_charge(device: Device, sensor: SensorPlan, charge: Buffer) -> None:
    """Move charge above the full well of the computed photosites [e-], in place, to those that have room.

    charge: (height, width) float32, not limited to the full well. Does nothing without blooming, and where no well is full.
    """
    geometry = sensor.readout
    blooming, area = geometry.blooming, geometry.computed
    size, capacity_e = (area.width, area.height), np.float32(sensor.capacity_e)
    if blooming is None or _greatest(device, charge, *size) <= capacity_e:
        return
    packets, arriving = (device.empty((blooming.sides, area.height, area.width), np.float32) for _ in range(2))
    start, step = (
        device.kernel(f"blooming_{part}", {"SIDES": blooming.sides}, file="blooming.cl") for part in ("start", "step")
    )
    device.run(start, size, None, charge=charge, packets=packets, capacity_e=capacity_e)
    for count in range(blooming.reach):
        device.run(step, size, None, charge=charge, packets=packets, arriving=arriving, capacity_e=capacity_e)
        packets, arriving = arriving, packets
        if (
            count % STEPS_AT_ONCE == STEPS_AT_ONCE - 1
            and _greatest(device, packets, area.width, blooming.sides * area.height) == 0
        ):
            break  # all charge has found room


def _greatest(device: Device, image: Buffer, width: int, height: int) -> float:
    """Return the greatest value of a buffer (height, width) float32."""
    rows = np.append(np.arange(0, height, TILE_HEIGHT), height)
    return float(tile_extremes(device, image, width, rows)[1].max())


def remosaic_variance(device: Device, sensor: SensorPlan, variance: np.ndarray) -> np.ndarray:
    """Return the variance of the codes of the frame's pixels after remosaic [DN^2], (height, width) float32.

    variance: of the codes of the computed photosites, (height, width) float32 [DN^2], of which noise that is common to rows is
    shared. Counts that electrical crosstalk correlates are taken for independent. A sum of codes is rounded again.
    """
    geometry = sensor.readout
    assert geometry.pattern is not None  # called only for cameras that remosaic
    weights, common_dn2 = remosaic_weights(geometry.pattern), sensor.row_noise_dn2()
    area, (rows, columns) = geometry.computed, geometry.pattern.period
    places = np.ix_((area.y + np.arange(area.height)) % rows, (area.x + np.arange(area.width)) % columns)
    shared = np.minimum(variance, np.float32(sum(common_dn2.values())))  # of clipped codes no more than there is
    kept = np.zeros(weights.shape[:2])
    for stage, dn2 in common_dn2.items():
        share, rows_of = dn2 / sum(common_dn2.values()), weights.sum(axis=3, dtype=np.float64)
        down = np.arange(rows_of.shape[2])
        kept += share * np.einsum("yxi,ij,yxj->yx", rows_of, stage.row_correlation(down[:, None] - down), rows_of)
    alone = device.upload(variance - shared)
    spread = _remosaic(device, geometry, geometry.pattern, "signal", alone, {"most": MOST_ELECTRONS}, weights**2)
    rounding = np.where(weights.max(axis=(2, 3)) == 1.0, np.float32(0.0), np.float32(1.0 / 12.0))[places]
    independent = device.download(spread, (area.height, area.width), np.float32)
    return (independent + kept.astype(np.float32)[places] * shared + rounding)[geometry.kept]


def _remosaic(
    device: Device,
    geometry: ReadoutGeometry,
    pattern: Cfa,
    what: str,
    source: Buffer,
    limit: dict[str, float],
    weights: np.ndarray | None = None,
) -> Buffer:
    """Return "codes" or a "signal" of the computed photosites in the colours of a Bayer pattern.

    pattern: of their groups. limit: argument of the kernel, the largest result. weights: others than those of the codes.
    """
    area, dtype = geometry.computed, np.uint16 if what == "codes" else np.float32
    result = device.empty((area.height, area.width), dtype)
    kernel = device.kernel(f"remosaic_{what}", {"PERIOD": pattern.period[0], "REACH": pattern.group}, file="remosaic.cl")
    table = device.upload(remosaic_weights(pattern) if weights is None else weights)
    places = {"first_x": area.x % pattern.period[1], "first_y": area.y % pattern.period[0]}
    device.run(kernel, (area.width, area.height), None, **{what: source}, mosaic=result, weights=table, **places, **limit)
    return result


def _receive(device: Device, geometry: ReadoutGeometry, launch: Callable[[Buffer], None], dtype: DTypeLike) -> np.ndarray:
    """Return what a launch writes for the computed photosites, cropped to the output window.

    The result is an array of its own: kernels write into it on a CPU, so that its memory is neither copied nor mapped twice.
    """
    array = device.array((geometry.computed.height, geometry.computed.width), dtype)
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


def share_variance(device: Device, geometry: ReadoutGeometry, variance: Buffer, is_summed: bool) -> Buffer:
    """Return the variance of charges after electrical crosstalk [e-^2], float32.

    variance: of the independent charges of the computed photosites, (height, width) float32 [e-^2]. is_summed: whether the
    result is that of the sums of binned photosites, in the shape of the binned frame, or that of each photosite.
    """
    area, frame, factor, step = geometry.computed, geometry.computed, 1, 1
    if is_summed and geometry.binning is not None:
        frame, factor, step = geometry.binned, geometry.binning.factor, geometry.filter_step
    result = device.empty((frame.height, frame.width), np.float32)
    kernel = device.kernel("crosstalk_variance", {"FACTOR": factor, "STEP": step})
    shares = device.upload(geometry.crosstalk.shares_at_edges(factor, step))
    arguments = {"variance": variance, "mixed": result, "shares": shares, "width": area.width, "height": area.height}
    device.run(kernel, (frame.width, frame.height), None, **arguments)
    return result


def share_charge(device: Device, geometry: ReadoutGeometry, charge: Buffer) -> Buffer:
    """Return the charge [e-] that is read out: after electrical crosstalk, and summed over binned photosites."""
    if geometry.mixes_charge:
        charge = share_with_neighbors(device, charge, geometry.computed, geometry.crosstalk.electrical_shares)
    return _bin(device, geometry, "electrons", charge, np.float32) if geometry.adds_charge else charge


def read_charge_moments(device: Device, sensor: SensorPlan, light: Buffer) -> Moments:
    """Return mean [e-] and variance [e-^2] of the charge of each photosite that is read out, (height, width) float32 each.

    light: as of `read_mean_electrons`. Electrical crosstalk mixes the means with its shares, the variances with their squares.
    Charges of binned photosites are summed; where their codes are averaged, the shared variance is what they have in common.
    """
    geometry, frame, read = sensor.readout, sensor.readout.computed, sensor.readout.read
    shape = frame.height, frame.width
    electrons = device.empty(shape, np.float32)
    mean_electrons(device, light, electrons, shape, [FrameSetting(sensor.stages, x=frame.x, y=frame.y)])
    light_e = Moments(device.download(electrons, shape, np.float32), np.zeros(shape, np.float32))
    collected = map_moments(sensor.charge_steps(), light_e)
    mean, apart = share_charge(device, geometry, device.upload(collected.mean)), device.upload(collected.variance)
    variance = share_variance(device, geometry, apart, geometry.adds_charge)
    found = Moments(*(device.download(one, (read.height, read.width), np.float32) for one in (mean, variance)))
    if not geometry.averages:
        return found
    (rows, columns), binned = geometry.binned_places(), geometry.binned
    sums = share_variance(device, geometry, apart, True), _bin(device, geometry, "electrons", variance, np.float32)
    of_sum, alone = (device.download(one, (binned.height, binned.width), np.float32) for one in sums)
    common = np.divide(of_sum - alone, alone, out=np.zeros_like(alone), where=alone > 0.0)
    return found.plus(shared_variance=common[np.ix_(rows, columns)] * found.variance)


def mixed_variance(device: Device, sensor: SensorPlan, light: Buffer) -> np.ndarray:
    """Return the variance of each code [DN^2] of a sensor with electrical crosstalk, (height, width) float32.

    light: as of `read_mean_electrons`.
    """
    variance = map_moments(sensor.readout_steps(), read_charge_moments(device, sensor, light)).variance
    if sensor.readout.averages:
        variance = download_averaged(device, sensor.readout, device.upload(variance))
    return variance[sensor.readout.kept]


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
