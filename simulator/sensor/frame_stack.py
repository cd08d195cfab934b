"""Simulate the sensor alone for a stack of frames: from mean photoelectrons to codes, without lens and exposure."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Device
from simulator.errors import require
from simulator.sensor.code_variance import code_variance
from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, launch_sensor
from simulator.sensor.kernel.kernel_program import MOST_ELECTRONS, signal_steps
from simulator.sensor.kernel.noise_free import code_of_light


def expose_frame_stack(device: Device, mean_electrons: np.ndarray, settings: Sequence[FrameSetting]) -> np.ndarray:
    """Return the codes (frames, height, width) uint16 [DN] of a stack of frames, each with its own setting.

    Frames whose cameras have the same stages share kernel launches. The codes of a frame depend only on its own mean electrons
    and setting, not on the other frames or their order.
    mean_electrons: (frames, height, width), mean photoelectrons [e-], finite and not negative.
    settings: one for each frame.
    Crosstalk, binning and optical black are not simulated here but in whole shots: `simulator.pipeline.simulate`.
    Raises PhotositeError for electrons out of range, and for settings that do not match them or act on light.
    """
    mean_electrons = _checked(mean_electrons, settings)
    count, height, width = mean_electrons.shape
    codes = np.empty((count, height, width), np.uint16)
    if codes.size:
        source, result = device.share(mean_electrons), device.receive(codes)
        launch_sensor(device, source, result, (height, width), settings, KernelPart.WHOLE)
        device.collect(result, codes)
    return codes


def frame_stack_moments(
    device: Device, mean_electrons: np.ndarray, settings: Sequence[FrameSetting]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the noise-free code [DN] and the variance [DN^2] of the codes of `expose_frame_stack`.

    Both are float32 arrays of the shape of mean_electrons. The noise-free code is not rounded, but clipped as the sensor
    clips. Neither includes the fixed pattern of the body or a per-channel black offset (color_bias). The variance is that of
    temporal noise and rounding; see `simulator.sensor.code_variance`. Arguments and errors: as for `expose_frame_stack`.
    """
    mean_electrons = _checked(mean_electrons, settings)
    codes, variance = (np.empty(mean_electrons.shape, np.float32) for _ in range(2))
    if not mean_electrons.size:
        return codes, variance
    result = device.receive(codes)
    code_of_light(device, device.share(mean_electrons), result, mean_electrons.shape[1:], settings)
    for electrons, setting, frame in zip(mean_electrons, settings, variance, strict=True):
        frame[:] = code_variance(signal_steps(setting.stages), electrons)
    device.collect(result, codes)
    return codes, variance


def _checked(mean_electrons: np.ndarray, settings: Sequence[FrameSetting]) -> np.ndarray:
    """Return the mean electrons as a contiguous float32 array. Raises PhotositeError as `expose_frame_stack` says."""
    mean_electrons = np.ascontiguousarray(mean_electrons, np.float32)
    shape = mean_electrons.shape
    require(mean_electrons.ndim == 3, "mean_electrons", f"array of shape {shape}", "give (frames, height, width)")
    require(len(settings) == shape[0], "settings", f"{len(settings)} settings", f"give one for each of the {shape[0]} frames")
    for place, setting in enumerate(settings):
        light = ", ".join(stage.stem for stage in setting.stages if stage.acts_on_light)
        rule = "photoelectrons have been through lens and exposure; leave it out"
        require(not light, f"settings[{place}].stages", light, rule)
    # One pass over the data: read as integers, the bits of floats >= 0 have the order of the floats, and those of negative
    # numbers and NaN are larger than all of them.
    if mean_electrons.size and mean_electrons.view(np.uint32).max() > np.float32(MOST_ELECTRONS).view(np.uint32):
        least, most = float(mean_electrons.min()), float(mean_electrons.max())
        good = least >= 0.0 and most <= MOST_ELECTRONS  # -0.0 is allowed
        require(good, "mean_electrons", f"{least:g} to {most:g}", f"give numbers from 0 to {MOST_ELECTRONS:g} e-")
    return mean_electrons
