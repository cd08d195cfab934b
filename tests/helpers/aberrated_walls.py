"""A lens with aberrations before walls at stated blur radii."""

import math

import numpy as np

from helpers.green_frames import PITCH_UM
from helpers.psf_frames import SIDE
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations

SPHERICAL = Aberrations(spherical_um=0.4)
FOCUS_M = 2.0


def thin_lens(f_number: float, aberrations: Aberrations) -> ThinLens:
    return ThinLens(50.0, f_number, FOCUS_M, cos4=False, aberrations=aberrations)


def depth_at(through: ThinLens, radius_px: float | np.ndarray) -> float | np.ndarray:
    """Distance at which a lens has blur circles of this signed radius [m]."""
    per_dioptre = float(through.blur_radius_um(math.inf) - through.blur_radius_um(1.0)) / PITCH_UM
    return 1.0 / (1.0 / FOCUS_M - radius_px / per_dioptre)


def depth_map(through: ThinLens, left_px: float, right_px: float) -> np.ndarray:
    """Two walls side by side, of these blur radii."""
    depth = np.full((SIDE, SIDE), depth_at(through, right_px), np.float32)
    depth[:, : SIDE // 2] = depth_at(through, left_px)
    return depth
