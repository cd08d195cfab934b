"""Photosite: a raw-sensor image-formation simulator on OpenCL.

    >>> import simulator
    >>> shot = simulator.load_shot("configs/shots/color_checker.yaml", ["exposure.iso=400"])
    >>> raw = simulator.simulate(shot)
    >>> simulator.save(raw, "out")

The names below are imported when they are first used, so that importing the package costs nothing.
"""

import importlib

__version__ = "0.1.0"

_HOMES = {
    "load_camera": "simulator.config",
    "load_shot": "simulator.config",
    "load_sweep": "simulator.config",
    "schema": "simulator.config",
    "shot_warnings": "simulator.config",
    "simulate": "simulator.pipeline",
    "resimulate": "simulator.resimulation",
    "Raw": "simulator.frame",
    "Shot": "simulator.shot",
    "save": "simulator.raw.save",
    "develop": "simulator.development",
    "PhotositeError": "simulator.errors",
}
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'simulator' has no attribute {name!r}")
    globals()[name] = value = getattr(importlib.import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
