"""The fused sensor kernel as Python sees it: its stages, their order, and the macros that switch them."""

import math
import re
import zlib
from collections.abc import Iterable, Sequence
from functools import cache, reduce

import numpy as np

from simulator.device import kernel_source
from simulator.sensor.stages.poisson_variants import MACROS
from simulator.sensor.stages.registry import FUSED
from simulator.sensor.stages.stage import Limits, Moments, SignalStep, Stage

MOST_ELECTRONS = 1e30  # far above any light, and far enough below 3e38 that no product on the way overflows


def stage_order() -> tuple[str, ...]:
    """Stems of the fused stages as they stand in kernels/sensor.cl: order is physics and is written there only."""
    return CHARGE_STAGES + READOUT_STAGES


def in_order(stages: Iterable[Stage]) -> tuple[Stage, ...]:
    """Fused stages that have an effect, in physical order."""
    present = {stage.stem: stage for stage in stages if stage.has_effect}
    return tuple(present[stem] for stem in stage_order() if stem in present)


def _stages_of(function: str) -> tuple[str, ...]:
    """Stems of the stages that a function of kernels/sensor.cl calls."""
    text = kernel_source("sensor.cl")
    body = text[text.index(f"INLINE float {function}(") :]
    return tuple(re.findall(r"^\s*(?:if \(\w+\) )?signal = (\w+)\(signal", body[: body.index("\n}")], re.MULTILINE))


CHARGE_STAGES, READOUT_STAGES = _stages_of("charge"), _stages_of("readout")


def signal_steps(stages: Iterable[Stage], between: Sequence[SignalStep] = ()) -> list[SignalStep]:
    """Steps of stages in physical order. between: those of the passes between the charge and its readout."""
    charge = [stage.signal_step() for stage in stages if stage.stem in CHARGE_STAGES]
    return [*charge, *between, *(stage.signal_step() for stage in stages if stage.stem in READOUT_STAGES)]


def stage_moments(stages: tuple[Stage, ...], mean_electrons: float) -> Moments:
    """Mean and variance of the code [DN] behind sensor stages in physical order, for a mean number of photoelectrons."""
    return reduce(lambda signal, stage: stage.moments(signal), stages, Moments(mean_electrons, 0.0))


def white_level_dn(steps: Iterable[SignalStep], black_level_dn: float) -> int:
    """Code of a saturated photosite: of whatever clips first, the full well or the ADC; above black [DN].

    steps: from the photoelectrons to the code, in physical order; one of them clips.
    """
    greatest: list[float] = []  # signal at which each step before clips, as it is seen here
    limits: Limits = (-math.inf, math.inf)
    for step in steps:
        greatest = [step.moments(Moments(signal, 0.0)).mean for signal in greatest]
        clipped = step.clip_limits(limits)
        if clipped is not None:
            limits = clipped
            greatest.append(limits[1])
    return max(round(min(greatest)), math.floor(black_level_dn) + 1)  # ties to even, as the ADC's


@cache
def _macros(stem: str) -> tuple[tuple[str, str], ...]:
    """Macros that the kernel reads of a stage, each with a value that lets the code of an absent stage compile."""
    names = sorted(set(re.findall(rf"\b({stem.upper()}_\w+)(\[?)", kernel_source("sensor.cl"))))
    return tuple((name, "parameters" if bracket else "0") for name, bracket in names if not name.endswith("_H"))


@cache
def _absent() -> dict[str, object]:
    """Macros of the fused kernel without any stage."""
    defines: dict[str, object] = dict(MACROS)
    for stem in FUSED:
        defines |= {stem.upper(): 0, **dict(_macros(stem)), f"{stem.upper()}_STREAM": f"{zlib.crc32(stem.encode())}u"}
    return defines


def sensor_defines(stages: tuple[Stage, ...]) -> tuple[dict[str, object], np.ndarray]:
    """Macros and parameter array of the fused kernel.

    Each stage is a macro 1 or 0, each of its numbers a macro STEM_FIELD that reads the array (so that another
    ISO needs no new build), and STEM_STREAM its own stream of random numbers. NUMBERS: length of the array.
    """
    defines, values = dict(_absent()), []
    for stage in sorted(stages, key=lambda stage: stage_order().index(stage.stem)):
        defines[stage.stem.upper()] = 1
        defines.update(_stage_defines(stage, values))
    defines["NUMBERS"] = len(values)
    return defines, np.array(values, dtype=np.float32)


def _stage_defines(stage: Stage, values: list[float]) -> dict[str, object]:
    """Macros of one stage; its numbers are appended to the array."""
    defines: dict[str, object] = {}
    for name, value in stage.kernel_values().items():
        macro = f"{stage.stem}_{name}".upper()
        if isinstance(value, tuple):
            defines[macro], defines[f"{macro}_COUNT"] = f"(parameters + {len(values)})", len(value)
            values.extend(value)
        else:
            defines[macro] = f"parameters[{len(values)}]"
            values.append(float(value))
    switches = {f"{stage.stem}_{name}".upper(): value for name, value in stage.kernel_switches().items()}
    return defines | switches
