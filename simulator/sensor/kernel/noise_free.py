"""Noise-free signal of a sensor for a stack of frames: the passes of kernels/truth.cl."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.sensor.kernel.kernel_launch import FrameSetting, form_launch_groups


def mean_charge(
    device: Device, light: Buffer, shape: tuple[int, int], settings: Sequence[FrameSetting]
) -> tuple[Buffer, Buffer]:
    """Return the mean photoelectrons [e-] and the mean electrons in the well [e-], buffers (frames, *shape) float32.

    light: device buffer (frames, *shape) float32, as the input of kernels/sensor.cl. shape: (height, width).
    """
    whole = (len(settings), *shape)
    mean_electrons, signal = device.empty(whole, np.float32), device.empty(whole, np.float32)
    _run(device, "mean_charge", shape, settings, light=light, mean_electrons=mean_electrons, signal=signal)
    return mean_electrons, signal


def noise_free(device: Device, signal: Buffer, shape: tuple[int, int], settings: Sequence[FrameSetting]) -> None:
    """Convert mean electrons in the well [e-], in place, to the code without noise and rounding, clipped as by the sensor [DN].

    signal: device buffer (frames, *shape) float32. shape: (height, width).
    """
    _run(device, "noise_free", shape, settings, signal=signal)


def _run(device: Device, name: str, shape: tuple[int, int], settings: Sequence[FrameSetting], **buffers: Buffer) -> None:
    """Run the kernel `name` of kernels/truth.cl on these buffers, once for each launch group."""
    for group in form_launch_groups(settings, device.constant_bytes):
        places = [(place, settings[place].x, settings[place].y) for place in group.places]
        device.run(
            device.kernel(name, group.defines, file="truth.cl"),
            (shape[1], shape[0], len(places)),
            None,
            frames=device.upload(np.array(places, np.uint32)),
            numbers=device.upload(group.numbers),
            **buffers,
        )
