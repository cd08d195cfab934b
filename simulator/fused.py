"""The fused sensor kernel as Python sees it: its stages, their order, and the macros that switch them."""

import re
import zlib
from dataclasses import fields
from enum import IntEnum

import numpy as np

from simulator.device import kernel_source
from simulator.exposure import Integration
from simulator.lens import Irradiance
from simulator.sensor import STAGES
from simulator.stage import Stage

POISSON_SWITCH_E = 5.0  # below this mean the Poisson expansion is off by more than 1e-4; kernels/poisson.h inverts there
FUSED = {Irradiance.stem: Irradiance, Integration.stem: Integration, **STAGES}


SMALL_MEANS_E = (POISSON_SWITCH_E, 2.0, 0.5)  # greatest means of SMALL, SMALLER, SMALLEST


class PoissonMeans(IntEnum):
    """Means that a launch can count, as kernels/poisson.h numbers them."""

    LARGE = 0
    ALL = 1
    SMALL = 2
    SMALLER = 3
    SMALLEST = 4


def stage_order() -> tuple[str, ...]:
    """Stems of the fused stages as they stand in kernels/sensor.cl: order is physics and is written there only."""
    return tuple(re.findall(r"^\s*signal = (\w+)\(", _sensor_page(), re.MULTILINE))


def _sensor_page() -> str:
    text = kernel_source("sensor.cl")
    return text[text.index("kernel void sensor(") :]


def sensor_defines(stages: tuple[Stage, ...]) -> tuple[dict[str, object], np.ndarray]:
    """Macros and parameter array of the fused kernel.

    Each stage is a macro 1 or 0, each of its numbers a macro STEM_FIELD that reads the array (so that another
    ISO needs no new build), and STEM_STREAM its own stream of random numbers.
    """
    values = {name: value for stage in stages for name, value in stage.kernel_parameters().items()}
    present = {stage.stem for stage in stages}
    defines: dict[str, object] = {}
    for stem, stage_class in FUSED.items():
        defines[stem.upper()] = int(stem in present)
        defines[f"{stem}_STREAM".upper()] = f"{zlib.crc32(stem.encode())}u"
        if stem not in present:
            defines.update({f"{stem}_{field.name}".upper(): "0.0f" for field in fields(stage_class)})
    defines["POISSON_SWITCH"] = f"{POISSON_SWITCH_E}f"
    defines.update({name: f"parameters[{index}]" for index, name in enumerate(values)})
    return defines, np.array(list(values.values()), dtype=np.float32)
