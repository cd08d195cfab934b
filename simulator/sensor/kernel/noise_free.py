"""Noise-free signal of a sensor for a stack of frames: the passes of kernels/truth.cl."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.sensor.kernel.kernel_launch import FrameSetting, form_launch_groups
from simulator.sensor.stages.registry import FUSED

STAGES = tuple(stem for stem, stage in FUSED.items() if stage.changes_mean)  # that these passes apply


def mean_electrons(
    device: Device, light: Buffer, electrons: Buffer, shape: tuple[int, int], settings: Sequence[FrameSetting]
) -> None:
    """Write the mean photoelectrons [e-].

    light, electrons: device buffers (frames, *shape) float32; light as the input of kernels/sensor.cl. shape: (height, width).
    """
    _run(device, "mean_electrons", shape, settings, light=light, electrons=electrons)


def mean_charge(
    device: Device, light: Buffer, charge: Buffer, shape: tuple[int, int], settings: Sequence[FrameSetting]
) -> None:
    """Write the mean electrons in the well [e-]. Buffers and shape: as for `mean_electrons`."""
    _run(device, "mean_charge", shape, settings, light=light, charge=charge)


def code_of_charge(device: Device, signal: Buffer, shape: tuple[int, int], settings: Sequence[FrameSetting]) -> None:
    """Convert mean electrons in the well [e-], in place, to the code without noise and rounding, clipped as by the sensor [DN].

    signal: device buffer (frames, *shape) float32. shape: (height, width).
    """
    _run(device, "code_of_charge", shape, settings, signal=signal)


def code_of_light(
    device: Device, light: Buffer, code: Buffer, shape: tuple[int, int], settings: Sequence[FrameSetting]
) -> None:
    """Write the code without noise and rounding of a sensor whose photosites share no charge, clipped as by the sensor [DN].

    Buffers and shape: as for `mean_electrons`.
    """
    _run(device, "code_of_light", shape, settings, light=light, code=code)


def _run(device: Device, name: str, shape: tuple[int, int], settings: Sequence[FrameSetting], **buffers: Buffer) -> None:
    """Run the kernel `name` of kernels/truth.cl on these buffers, once for each launch group."""
    for group in form_launch_groups(settings, STAGES, device.constant_bytes):
        places = [(place, settings[place].x, settings[place].y) for place in group.places]
        device.run(
            device.kernel(name, group.defines, file="truth.cl"),
            (shape[1], shape[0], len(places)),
            None,
            frames=device.upload(np.array(places, np.uint32)),
            numbers=device.upload(group.numbers),
            **buffers,
        )
