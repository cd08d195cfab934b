"""Frames whose light is spread by a point spread function, and their error against SciPy's convolution in float64."""

import dataclasses
import math
from typing import Any

import numpy as np
from scipy.signal import fftconvolve

from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, lens
from helpers.kernels_alone import electrons_by_kernels
from helpers.lens_error import statistics, z_scores
from helpers.scene_builders import band_scene
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate

SIDE = 160
MARGIN = 64  # beyond the scene its edge goes on
BRIGHTEST_E = 2000.0


def contrasts() -> np.ndarray:
    """Squares of 20 photosites and a texture of single photosites, 50:1."""
    rng = np.random.default_rng(3)
    squares = np.kron((rng.random((SIDE // 20, SIDE // 20)) < 0.6), np.ones((20, 20)))
    texture = 0.3 + 0.7 * rng.random((SIDE, SIDE))
    texture[:, : SIDE // 2] = 1.0
    return 0.02 + 0.98 * squares * texture


def shot_of(
    planes: np.ndarray, through: ThinLens, depth_m: float | np.ndarray, interpolation: str = "nearest", **settings: Any
) -> Shot:
    camera = green_camera(SIDE, SIDE, **settings)
    sharp = Shot(band_scene(planes, math.inf, interpolation=interpolation), lens(through.f_number), EXPOSURE, camera)
    brightest_e = float(np.quantile(simulate(sharp).mean_electrons, 0.999))
    exposure = dataclasses.replace(EXPOSURE, time_s=EXPOSURE.time_s * BRIGHTEST_E / brightest_e)
    return Shot(band_scene(planes, depth_m, interpolation=interpolation), through, exposure, camera)


def error(shot: Shot, planes: np.ndarray, kernel: np.ndarray, shown: tuple[slice, slice] = (slice(None), slice(None))) -> float:
    """p99.9 of the error against a convolution with this kernel [standard deviations]."""
    found = electrons_by_kernels(shot)
    truth = fftconvolve(np.pad(planes, MARGIN, mode="edge"), kernel, mode="same")[MARGIN:-MARGIN, MARGIN:-MARGIN]
    truth = np.maximum(truth, 0.0)  # what is below 0 by ringing becomes 0
    scale = found[shown].sum() / truth[shown].sum() / BRIGHTEST_E
    return statistics(z_scores(found[shown] / (scale * BRIGHTEST_E), truth[shown], BRIGHTEST_E)).p99_9
