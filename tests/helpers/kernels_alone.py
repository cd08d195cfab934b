"""Frames by kernels alone: without light from beyond them (`simulator.optics.psf.wings`), which take its place, and without
what rays add to layers on the reference path (`simulator.optics.passes.layer_rays`)."""

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


def without_layer_rays(planned: Plan) -> Plan:
    """Plan of the same shot whose layers are spread by kernels alone, with their covariance over points of the aperture."""
    return dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, layer_rays=False))


def electrons_by_kernels(shot: Shot) -> np.ndarray:
    """Mean electrons of a shot by its kernels alone, (height, width) float64."""
    device = open_device()
    planned = measure(without_layer_rays(without_wings(plan(shot))), device)
    return execute(planned, shot, device, silent, Stopwatch()).mean_electrons.astype(np.float64)
