"""Passes of an HDR read-out: each reading of each exposure by the fused kernel, then combined in place."""

import zlib
from collections.abc import Iterator, Sequence

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
    read = sensor.readout.read
    shape = read.height, read.width
    combined, codes = (device.empty(shape, np.uint16) for _ in range(2))
    kernel = device.kernel("combine_codes", {}, file="hdr_readout.cl")
    for place, source, part in _sources(device, sensor, lights, seeds):
        reading = sensor.readings[place]
        launch_sensor(device, source, codes, shape, [_setting(reading, place, seeds, read)], part)
        arguments = {"codes": codes, "table": device.upload(sensor.table(reading)), "combined": combined}
        device.run(kernel, shape[::-1], None, **arguments, switch_dn=reading.switch_dn)
    return device.download(combined, shape, np.uint16)[sensor.readout.kept]


def read_noise_free_combined(device: Device, sensor: HdrSensorPlan, lights: Sequence[Buffer]) -> np.ndarray:
    """Return the combined signal without noise, rounding and companding [DN], (height, width) float32.

    It is clipped at 0 and the white level. lights: as above.
    """
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
            combined_white_dn=float(sensor.white_level_dn()),
            switch_dn=float(reading.switch_dn),
        )
    return device.download(combined, (read.height, read.width), np.float32)[sensor.readout.kept]


def reading_seeds(seeds: Seeds, place: int) -> Seeds:
    """Return the seeds of a reading: those of the frame for the first one, another frame's for each of the others."""
    if place == 0:
        return seeds
    return Seeds(seeds.body, zlib.crc32(f"reading {place} of frame {seeds.frame}".encode()))


def diode_seeds(seeds: Seeds, diode: int) -> Seeds:
    """Return the seeds of a photodiode: those of the frame for the first one, another body's fixed pattern for each other."""
    if diode == 0:
        return seeds
    return Seeds(zlib.crc32(f"photodiode {diode} of body {seeds.body}".encode()), seeds.frame)


def _sources(
    device: Device, sensor: HdrSensorPlan, lights: Sequence[Buffer], seeds: Seeds
) -> Iterator[tuple[int, Buffer, KernelPart]]:
    """Yield the place of each reading, the last one first, with what it reads, and the part of the fused kernel that reads it.

    Readings of one charge read it after each other; a reading that has a charge alone turns light into codes at once, but for
    that of a second photodiode: the diodes differ in the fixed pattern of their charge, what reads them is the same.
    """
    frame, spec = sensor.readout.computed, sensor.spec
    charge, collected = None, None
    for place in reversed(range(len(sensor.readings))):
        own, light, diode = spec.charge_of[place], lights[spec.exposure_of[place]], spec.diode_of[place]
        if spec.charge_of.count(own) == 1 and diode == 0 and not sensor.readout.shares_charge:
            yield place, light, KernelPart.WHOLE
            continue
        if charge is None or collected != own:
            first, shape = spec.charge_of.index(own), (frame.height, frame.width)
            charge, collected = device.empty(shape, np.float32), own
            setting = _setting(sensor.readings[first], first, diode_seeds(seeds, diode), frame)
            launch_sensor(device, light, charge, shape, [setting], KernelPart.CHARGE)
            charge = share_charge(device, sensor.readout, charge)
        yield place, charge, KernelPart.READOUT


def _setting(reading: Reading, place: int, seeds: Seeds, window: Window) -> FrameSetting:
    return FrameSetting(reading.sensor.stages, reading_seeds(seeds, place), window.x, window.y)
