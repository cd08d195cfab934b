"""One photosite explained: from the light that falls on it to its code, and where its noise comes from."""

import math
from dataclasses import replace

import numpy as np

from simulator.explore.figures import Data, color_names, finite
from simulator.explore.pictures import color_planes
from simulator.pipeline.explain.grey_patch import grey_patch
from simulator.pipeline.explain.noise_budget import noise_budget
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.readout_window import block_px

PATCH_PX = 16  # side of the patch whose noise is measured, of one colour
CURVE_POINTS = 65  # of the photon transfer curve


def explain_pixel(shot: Shot, planned: Plan, raw: Raw, again: Raw, x: int, y: int) -> Data:
    """Return the story of the photosite in column x, row y of a window of the shot, from cd/m^2 to DN.

    planned: of the shot. raw, again: two frames of the window that differ in temporal noise alone.
    The luminance is that of a grey surface in the scene's light that gives as many electrons. Temporal noise is measured in the
    photosites of the same colour around it, as half the variance of the difference of the two frames (EMVA 1288 R4.0, 6.6).
    """
    sensor, exposure = planned.sensor, shot.exposure
    plane = color_planes(raw)[y, x]
    mean_e = float(raw.mean_electrons[y, x])
    budget = noise_budget(sensor, mean_e, exposure.iso, exposure.time_s)
    white = grey_patch(shot, planned.optics.scene, 1.0, planned.exposed.components[0].most)
    per_white = None if white is None or white.electrons[plane] <= 0 else mean_e / float(white.electrons[plane])
    return {
        "x": x,
        "y": y,
        "color": color_names(raw.cfa)[plane],
        "luminance_cd_m2": None if white is None or per_white is None else per_white * white.luminance_cd_m2,
        "exposure_lx_s": None if white is None or per_white is None else per_white * white.exposure_lx_s,
        "photons": None if white is None or per_white is None else per_white * white.photons,
        "mean_electrons": mean_e,
        "mean_dn": float(raw.noise_free_dn[y, x]),
        "code_dn": int(raw.dn[y, x]),
        "black_level_dn": raw.black_level_dn,
        "white_level_dn": raw.white_level_dn,
        "sigma_e": finite(budget.sigma_e),
        "sigma_dn": finite(budget.sigma_dn),
        "snr": finite(budget.snr),
        "is_clipped": budget.is_clipped,
        "shares": {name: float(share) for name, share in budget.shares.items()},
        "transfer": _transfer(planned, raw, again, x, y),
    }


def _transfer(planned: Plan, raw: Raw, again: Raw, x: int, y: int) -> Data:
    """Return the photon transfer curve of the sensor, and the point that the patch around a photosite gives [DN, DN^2]."""
    sensor, (rows, columns) = planned.sensor, (1, 1) if raw.cfa == "MONO" else Cfa.named(raw.cfa).period
    electrons = np.geomspace(0.5, max(sensor.electrons_at_white(), 1.0), CURVE_POINTS)
    curve = [sensor.moments(float(mean)) for mean in electrons]
    black_dn = sensor.moments(0.0).mean
    part = _patch(y, rows), _patch(x, columns)
    first, second = raw.dn[part].astype(np.float64), again.dn[part].astype(np.float64)
    return {
        "curve_dn": [finite(one.mean - black_dn) for one in curve],
        "curve_dn2": [finite(one.variance) for one in curve],
        "mean_dn": finite(0.5 * float(first.mean() + second.mean()) - black_dn),
        "variance_dn2": finite(0.5 * float(np.var(first - second, ddof=1))),
        "photosites": first.size,
    }


def _patch(place: int, step: int) -> slice:
    """Return PATCH_PX rows or columns about a place, a period of the filter pattern apart."""
    first = place - PATCH_PX * step // 2
    first = max(first - first % step + place % step, place % step)
    return slice(first, first + PATCH_PX * step, step)


def window_at(shot: Shot, across: float, down: float, width_px: int, height_px: int) -> Shot:
    """Return the shot of a window around a place of the frame, given as shares 0 to 1 of its sides.

    width_px, height_px: of the picture that is given out, at most. It begins with a whole block of photosites that are binned.
    """
    frame, camera = shot.camera.frame, shot.camera
    factor, step = 1 if camera.binning is None else camera.binning.factor, math.lcm(2, block_px(camera))
    width, height = min(width_px * factor, frame.width), min(height_px * factor, frame.height)
    x = _whole(across * frame.width - 0.5 * width, frame.width - width, step, frame.x)
    y = _whole(down * frame.height - 0.5 * height, frame.height - height, step, frame.y)
    window = type(frame)(x, y, width, height)
    return replace(shot, camera=replace(camera, window=window), truth=())


def _whole(wanted: float, largest: int, step: int, first: int) -> int:
    """Return the photosite at which a window begins, whole steps from the first of the frame, near the wanted one."""
    return first + min(max(int(wanted), 0), largest) // step * step
