"""The sensor: one frozen dataclass per stage, one header of the same stem in kernels/.

The physical order of the stages is defined once, in kernels/sensor.cl.
A module of this package that defines a Stage with its own name as the stem is a sensor stage; no other registration is needed.
"""

import importlib
import pkgutil
from pathlib import Path

from simulator.sensor.stages.stage import Stage


def _find_stages() -> dict[str, type[Stage]]:
    """Return the stage classes of this package by stem (the module's name)."""
    found = {}
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        for value in vars(importlib.import_module(f"{__package__}.{module.name}")).values():
            if isinstance(value, type) and issubclass(value, Stage) and getattr(value, "stem", None) == module.name:
                found[module.name] = value
    return found


FUSED = _find_stages()
LIGHT_STAGES = {stem: stage for stem, stage in FUSED.items() if stage.acts_on_light}
STAGES = {stem: stage for stem, stage in FUSED.items() if not stage.acts_on_light}
