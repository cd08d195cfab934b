"""The light on the sensor, as contestants make it: from a plan, with its scene in memory, to a buffer on the device."""

from collections.abc import Callable

import numpy as np

from simulator.device import Device
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure

Made = dict[str, Callable[[], np.ndarray]]


def exposing(device: Device, planned: Plan, made: Made, name: str) -> Callable[[], None]:
    """Run of a plan's light on the sensor; leaves in `made` what returns it, (height, width) in each photosite's colour."""
    shape = planned.optics.window.height, planned.optics.window.width

    def run() -> None:
        mosaic = expose(measure(planned, device), device)
        device.finish()
        made[name] = lambda: device.download(mosaic, shape, np.float32)

    return run


def light_of(device: Device, planned: Plan) -> np.ndarray:
    """Light of a plan on the sensor, (height, width) in each photosite's colour."""
    made: Made = {}
    exposing(device, planned, made, "")()
    return made[""]()
