"""Passes of an HDR read-out: each reading of each exposure by the fused kernel, then combined in place."""

import zlib
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.hdr_plan import HdrSensorPlan, Reading
from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, launch_sensor
from simulator.sensor.kernel.noise_free import code_of_charge, mean_charge
from simulator.sensor.readout import share_charge
from simulator.sensor.seeds import Seeds


def read_out_combined(device: Device, sensor: HdrSensorPlan, lights: Sequence[Buffer], seeds: Seeds) -> np.ndarray:
    """Return the combined codes [DN] of the frame's pixels, companded and decoded, (height, width) uint16.

    lights: mosaic of electron radiance of each exposure, (height, width) float32; nothing changes them.
    seeds: of the frame; the first reading has the noise of a frame with these seeds that is read once.
    """
    frame, read = sensor.readout.computed, sensor.readout.read

    def collect(place: int, reading: Reading) -> Buffer:
        charge, setting = device.empty((frame.height, frame.width), np.float32), _setting(reading, place, seeds, frame)
        launch_sensor(device, lights[reading.exposure], charge, (frame.height, frame.width), [setting], KernelPart.CHARGE)
        return share_charge(device, sensor.readout, charge)

    combined = device.empty((read.height, read.width), np.uint16)
    codes = device.empty((read.height, read.width), np.uint16)
    kernel = device.kernel("combine_codes", {}, file="hdr_readout.cl")
    for place, charge in _charges(sensor, collect):
        reading = sensor.readings[place]
        setting = _setting(reading, place, seeds, read)
        launch_sensor(device, charge, codes, (read.height, read.width), [setting], KernelPart.READOUT)
        arguments = {"codes": codes, "table": device.upload(sensor.table(reading)), "combined": combined}
        device.run(kernel, (read.width, read.height), None, **arguments, switch_dn=reading.switch_dn)
    return device.download(combined, (read.height, read.width), np.uint16)[sensor.readout.kept]


def read_noise_free_combined(device: Device, sensor: HdrSensorPlan, lights: Sequence[Buffer]) -> np.ndarray:
    """Return the combined signal without noise, rounding and companding [DN], (height, width) float32. lights: as above."""
    frame, read = sensor.readout.computed, sensor.readout.read
    combined = device.empty((read.height, read.width), np.float32)
    kernel = device.kernel("combine_noise_free", {}, file="hdr_readout.cl")
    for reading in reversed(sensor.readings):
        charge, setting = device.empty((frame.height, frame.width), np.float32), [_setting(reading, 0, Seeds(), frame)]
        mean_charge(device, lights[reading.exposure], charge, (frame.height, frame.width), setting)
        level = share_charge(device, sensor.readout, charge)
        code_of_charge(device, level, (read.height, read.width), [_setting(reading, 0, Seeds(), read)])
        device.run(
            kernel,
            (read.width, read.height),
            None,
            level=level,
            combined=combined,
            black_dn=reading.black_dn,
            factor=reading.factor,
            combined_black_dn=sensor.black_level_dn,
            switch_dn=float(reading.switch_dn),
        )
    return device.download(combined, (read.height, read.width), np.float32)[sensor.readout.kept]


def reading_seeds(seeds: Seeds, place: int) -> Seeds:
    """Return the seeds of a reading: those of the frame for the first one, another frame's for each of the others."""
    if place == 0:
        return seeds
    return Seeds(seeds.body, zlib.crc32(f"reading {place} of frame {seeds.frame}".encode()))


def _charges(sensor: HdrSensorPlan, collect: Callable[[int, Reading], Buffer]) -> Iterator[tuple[int, Buffer]]:
    """Yield the place of each reading, the last one first, with the charge that it reads.

    collect: makes the charge of an exposure from the place of its first reading, and that reading.
    """
    charge, exposure = None, None
    for place in reversed(range(len(sensor.readings))):
        reading = sensor.readings[place]
        if charge is None or reading.exposure != exposure:
            exposure = reading.exposure
            first = sensor.spec.exposure_of.index(exposure)
            charge = collect(first, sensor.readings[first])
        yield place, charge


def _setting(reading: Reading, place: int, seeds: Seeds, window: Window) -> FrameSetting:
    return FrameSetting(reading.sensor.stages, reading_seeds(seeds, place), window.x, window.y)
