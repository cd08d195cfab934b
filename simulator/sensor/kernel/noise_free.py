"""What a sensor would give without chance, for a stack of frames: the passes of kernels/truth.cl."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Device
from simulator.sensor.kernel.kernel_launch import FrameSetting, groups


def mean_charge(device: Device, light, shape: tuple[int, int], settings: Sequence[FrameSetting]) -> tuple:
    """Device buffers (frames, *shape) float32: mean photoelectrons [e-], and mean electrons in the well [e-].

    light: device buffer (frames, *shape) float32, as the input of kernels/sensor.cl. shape: (height, width).
    """
    whole = (len(settings), *shape)
    mean_electrons, signal = device.empty(whole, np.float32), device.empty(whole, np.float32)
    _run(device, "mean_charge", shape, settings, light=light, mean_electrons=mean_electrons, signal=signal)
    return mean_electrons, signal


def noise_free(device: Device, signal, shape: tuple[int, int], settings: Sequence[FrameSetting]) -> None:
    """Turn electrons in the well [e-] into the code without noise and rounding, clipped as the sensor clips [DN].

    signal: device buffer (frames, *shape) float32; it is overwritten. shape: (height, width).
    """
    _run(device, "noise_free", shape, settings, signal=signal)


def _run(device: Device, name: str, shape: tuple[int, int], settings: Sequence[FrameSetting], **buffers) -> None:
    for group in groups(settings, device.constant_bytes):
        places = [(place, settings[place].x, settings[place].y) for place in group.places]
        device.run(
            device.kernel(name, group.defines, file="truth.cl"),
            (shape[1], shape[0], len(places)),
            None,
            frames=device.upload(np.array(places, np.uint32)),
            numbers=device.upload(group.numbers),
            **buffers,
        )
