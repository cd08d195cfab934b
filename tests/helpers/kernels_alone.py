"""Frames without light from beyond the kernels of diffraction (`simulator.optics.psf.wings`), which take its place."""

import dataclasses

import numpy as np

from simulator.device import open_device
from simulator.pipeline.execution import execute
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.progress import silent


def without_wings(planned: Plan) -> Plan:
    """Plan of the same shot with kernels that hold all light."""
    return dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, wings=None, wings_error=0.0))


def electrons_by_kernels(shot: Shot) -> np.ndarray:
    """Mean electrons of a shot by its kernels alone, (height, width) float64."""
    device = open_device()
    planned = measure(without_wings(plan(shot)), device)
    return execute(planned, shot, device, silent, Stopwatch()).mean_electrons.astype(np.float64)
