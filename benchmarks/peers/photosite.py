"""Photosite's fused sensor kernel: the picture lies on the device, one launch per kind of tile, codes stay on the device."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from measuring.contest import Contestant
from measuring.work import Sensor

from simulator.device import Device, DeviceInfo, open_device
from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, launch_sensor
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Stage


def named(info: DeviceInfo) -> str:
    """Name of Photosite on a device, in tables and charts."""
    return f"Photosite, {info.version if 'PoCL' in info.version else info.platform}"


class Missing(Exception):
    """A stage that this version of Photosite does not have."""


def stages_of(sensor: Sensor) -> list[Stage]:
    """Stages that make this sensor. Raises Missing for those that are not there."""
    numbers = {
        "photon_shot_noise": {},
        "full_well": {"capacity_e": sensor.full_well_e},
        "analog_gain": {"gain_dn_per_e": sensor.gain_dn_per_e},
        "adc": {"bit_depth": sensor.bit_depth, "black_level_dn": sensor.black_level_dn},
    }
    if sensor.full_well_e > 1e8:
        del numbers["full_well"]
    if sensor.before_e:
        numbers["read_noise_before_gain"] = {"sigma_e": sensor.before_e}
    if sensor.after_dn:
        numbers["read_noise_after_gain"] = {"sigma_dn": sensor.after_dn}
        if sensor.tukey_lambda is not None:
            numbers["read_noise_after_gain"]["tukey_lambda"] = sensor.tukey_lambda
    if sensor.row_dn:
        numbers["row_noise"] = {"sigma_dn": sensor.row_dn}
    if any(sensor.color_bias_dn):
        numbers["color_bias"] = {"offsets_dn": sensor.color_bias_dn}
    return [make(stem, **values) for stem, values in numbers.items()]


def make(stem: str, **values: Any) -> Stage:
    """A stage by name. Raises Missing."""
    stage = STAGES.get(stem)
    if stage is None or not {field.name for field in dataclasses.fields(stage)} >= set(values):
        raise Missing(f"no stage {stem}({', '.join(values)}) in this version")
    return stage(**values)


class DeletedStages:
    """A device that builds the sensor page with the lines of absent stages deleted by hand, in place of `#if`."""

    def __init__(self, device: Device, delete: Callable[[dict[str, object]], str]) -> None:
        self._device, self._delete, self._built = device, delete, {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    def kernel(self, name: str, defines: dict[str, object], file: str | None = None) -> Any:
        """As Device.kernel."""
        if name != "sensor":
            return self._device.kernel(name, defines, file)
        key = tuple(defines.items())
        if key not in self._built:
            self._built[key] = self._device.build(self._delete(defines), name, defines)
        return self._built[key]


def contestant(mean_e: np.ndarray, stages: list[Stage], device: Device, name: str) -> Contestant:
    """The fused kernel with these stages; adc and analog_gain among them."""
    settings = [FrameSetting(tuple(stages), Seeds(body=2, frame=1))]
    mosaic, codes = device.upload(mean_e), device.empty(mean_e.shape, np.uint16)

    def run() -> None:
        launch_sensor(device, mosaic, codes, mean_e.shape, settings, KernelPart.WHOLE)
        device.finish()

    return Contestant(name, run, lambda: device.download(codes, mean_e.shape, np.uint16), builds=True)


def on_device(mean_e: np.ndarray, sensor: Sensor, info: DeviceInfo) -> Contestant:
    """The fused kernel on one device."""
    return contestant(mean_e, stages_of(sensor), open_device(info.label), named(info))
