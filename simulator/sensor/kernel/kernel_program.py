"""The fused sensor kernel on the host's side: order of its stages, and the macros and parameters that configure it."""

import math
import re
import zlib
from collections.abc import Iterable, Sequence
from functools import cache, reduce

import numpy as np

from simulator.device.kernel_source import kernel_source
from simulator.sensor.stages.poisson_variants import MACROS
from simulator.sensor.stages.registry import FUSED
from simulator.sensor.stages.stage import Limits, Moments, SignalStep, Stage

MOST_ELECTRONS = 1e30  # above any light, and so far below 3e38 that no product of the stages overflows float32


def stage_order() -> tuple[str, ...]:
    """Return the stems of the fused stages in physical order, which is defined only by kernels/sensor.cl."""
    return CHARGE_STAGES + READOUT_STAGES


def in_order(stages: Iterable[Stage]) -> tuple[Stage, ...]:
    """Return the stages that have an effect, in physical order."""
    present = {stage.stem: stage for stage in stages if stage.has_effect}
    return tuple(present[stem] for stem in stage_order() if stem in present)


def _stages_of(function: str) -> tuple[str, ...]:
    """Return the stems of the stages that a function of kernels/sensor.cl calls, in their order."""
    text = kernel_source("sensor.cl")
    body = text[text.index(f"INLINE float {function}(") :]
    return tuple(re.findall(r"^\s*(?:if \(\w+\) )?signal = (\w+)\(signal", body[: body.index("\n}")], re.MULTILINE))


CHARGE_STAGES, READOUT_STAGES = _stages_of("charge"), _stages_of("readout")


def signal_steps(stages: Iterable[Stage], between: Sequence[SignalStep] = ()) -> list[SignalStep]:
    """Return the steps of stages given in physical order. between: steps of the passes between collected charge and readout."""
    charge = [stage.signal_step() for stage in stages if stage.stem in CHARGE_STAGES]
    return [*charge, *between, *(stage.signal_step() for stage in stages if stage.stem in READOUT_STAGES)]


def stage_moments(stages: tuple[Stage, ...], mean_electrons: float) -> Moments:
    """Return mean and variance of the code [DN] after stages given in physical order, for a mean number of photoelectrons."""
    return reduce(lambda signal, stage: stage.moments(signal), stages, Moments(mean_electrons, 0.0))


def white_level_dn(steps: Iterable[SignalStep], black_level_dn: float) -> int:
    """Return the code of a saturated photosite, which full well or ADC clips, whichever is lower; above black [DN].

    steps: from the photoelectrons to the code, in physical order; at least one of them clips.
    """
    greatest: list[float] = []  # clipping limit of each step before, as the signal after the current step
    limits: Limits = (-math.inf, math.inf)
    for step in steps:
        greatest = [step.moments(Moments(signal, 0.0)).mean for signal in greatest]
        clipped = step.clip_limits(limits)
        if clipped is not None:
            limits = clipped
            greatest.append(limits[1])
    return max(round(min(greatest)), math.floor(black_level_dn) + 1)  # ties to even, as the ADC's


@cache
def _words() -> tuple[tuple[str, str], ...]:
    """Return the words in capitals of the kernel's text, in order, each with the bracket behind it or ""."""
    return tuple(sorted(set(re.findall(r"\b([A-Z]+_\w+)(\[?)", kernel_source("sensor.cl")))))


def _macros(stem: str) -> tuple[tuple[str, str], ...]:
    """Return the macros of a stage that the kernel uses, with placeholder values so that an absent stage compiles."""
    names = [(name, bracket) for name, bracket in _words() if name.startswith(f"{stem.upper()}_") and not name.endswith("_H")]
    return tuple((name, "parameters" if bracket else "0") for name, bracket in names)


@cache
def _absent() -> dict[str, object]:
    """Return the macros of the fused kernel without any stage."""
    defines: dict[str, object] = dict(MACROS)
    for stem in FUSED:
        defines |= {stem.upper(): 0, **dict(_macros(stem)), f"{stem.upper()}_STREAM": f"{zlib.crc32(stem.encode())}u"}
    return defines


def sensor_defines(stages: tuple[Stage, ...]) -> tuple[dict[str, object], np.ndarray]:
    """Return the macros and the parameter array of the fused kernel.

    The macro STEM says whether a stage is present (1 or 0). STEM_FIELD reads a parameter from the array, so that another ISO
    needs no new build. STEM_STREAM numbers the random stream of the stage. NUMBERS is the length of the array.
    """
    values: list[float] = []
    defines = dict(_absent())
    for stage in sorted(stages, key=lambda stage: stage_order().index(stage.stem)):
        defines[stage.stem.upper()] = 1
        defines.update(_stage_defines(stage, values))
    defines["NUMBERS"] = len(values)
    return defines, np.array(values, dtype=np.float32)


def _stage_defines(stage: Stage, values: list[float]) -> dict[str, object]:
    """Return the macros of one stage, and append its parameters to `values`."""
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
