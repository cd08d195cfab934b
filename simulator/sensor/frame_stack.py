"""The sensor alone, for many frames at once: from mean photoelectrons to codes, without lens and exposure."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Device
from simulator.errors import require
from simulator.sensor.code_variance import code_variance
from simulator.sensor.kernel.kernel_launch import FrameSetting, Part, launch_sensor
from simulator.sensor.kernel.kernel_program import MOST_ELECTRONS, signal_steps
from simulator.sensor.kernel.noise_free import mean_charge, noise_free


def capture(device: Device, mean_electrons: np.ndarray, settings: Sequence[FrameSetting]) -> np.ndarray:
    """Codes (frames, height, width) uint16 [DN] of a stack of frames, each with its own camera, ISO, seeds and place.

    Frames whose cameras have the same stages run in one launch for each kind of tile. A frame's codes depend on its own
    mean electrons and setting alone: not on the other frames, nor on their order.
    mean_electrons: (frames, height, width), mean photoelectrons [e-], finite and not negative.
    settings: one for each frame.
    What neighbours share (crosstalk, binning, optical black) belongs to whole shots: `simulator.pipeline.simulate`.
    Raises PhotositeError for electrons or settings that cannot be.
    """
    mean_electrons = _checked(mean_electrons, settings)
    codes = np.empty(mean_electrons.shape, np.uint16)
    if codes.size:
        source, result = device.share(mean_electrons), device.share(codes)
        launch_sensor(device, source, result, codes.shape[1:], settings, Part.WHOLE)
        device.collect(result, codes)
    return codes


def moments(device: Device, mean_electrons: np.ndarray, settings: Sequence[FrameSetting]) -> tuple[np.ndarray, np.ndarray]:
    """What `capture` scatters about: code without noise [DN] and variance of the code [DN^2], float32, as mean_electrons.

    The code without noise is not rounded; it is clipped where the sensor clips. Neither holds the body's fixed pattern
    (nor a colour bias). The variance is that of temporal noise and rounding; see `simulator.sensor.code_variance`.
    Arguments and errors as of `capture`.
    """
    mean_electrons = _checked(mean_electrons, settings)
    shape, variance = mean_electrons.shape, np.empty(mean_electrons.shape, np.float32)
    if not mean_electrons.size:
        return variance, variance.copy()
    _, signal = mean_charge(device, device.share(mean_electrons), shape[1:], settings)
    noise_free(device, signal, shape[1:], settings)
    for electrons, setting, frame in zip(mean_electrons, settings, variance, strict=True):
        frame[:] = code_variance(signal_steps(setting.stages), electrons)
    return device.download(signal, shape, np.float32), variance


def _checked(mean_electrons: np.ndarray, settings: Sequence[FrameSetting]) -> np.ndarray:
    """Mean electrons as a contiguous float32 array."""
    mean_electrons = np.ascontiguousarray(mean_electrons, np.float32)
    shape = mean_electrons.shape
    require(mean_electrons.ndim == 3, "mean_electrons", f"array of shape {shape}", "give (frames, height, width)")
    require(len(settings) == shape[0], "settings", f"{len(settings)} settings", f"give one for each of the {shape[0]} frames")
    for place, setting in enumerate(settings):
        light = ", ".join(stage.stem for stage in setting.stages if stage.acts_on_light)
        rule = "photoelectrons have been through lens and exposure; leave it out"
        require(not light, f"settings[{place}].stages", light, rule)
    # One pass: as whole numbers, the bits of what is not negative rise with it, and all else (NaN too) lies above.
    if mean_electrons.size and mean_electrons.view(np.uint32).max() > np.float32(MOST_ELECTRONS).view(np.uint32):
        least, most = float(mean_electrons.min()), float(mean_electrons.max())
        good = least >= 0.0 and most <= MOST_ELECTRONS  # a -0.0 comes here, too
        require(good, "mean_electrons", f"{least:g} to {most:g}", f"give numbers from 0 to {MOST_ELECTRONS:g} e-")
    return mean_electrons
