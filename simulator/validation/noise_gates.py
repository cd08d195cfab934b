"""What the noise measured from files must agree with, and how well."""

import math
from collections.abc import Sequence

import numpy as np

from simulator.planner import Plan
from simulator.sensor import STAGES
from simulator.sensor.camera import Camera
from simulator.stage import Moments
from simulator.validation.flat_frames import FlatBench
from simulator.validation.gate import LEAST_SIGMAS, Gate
from simulator.validation.noise import IsoNoise, log_slope, noise_steps
from simulator.validation.noise_frames import CLEAR_SIGMAS, DARK_PAIRS, FramePlan

GAIN_TOLERANCE = 0.006
READ_NOISE_TOLERANCE = 0.015
FULL_SCALE_TOLERANCE = 0.006
RANGE_TOLERANCE_STOPS = 0.03  # 2 %
SLOPE_TOLERANCE = 0.005
STEP_TOLERANCE = 0.03
LEAST_READ_NOISE_DN = 0.5  # below, rounding hides it (EMVA 1288 sets its limit at a variance of 0.24 DN^2)
OF_WHOLE_ROWS = ("row_noise", "banding")


def iso_gates(found: IsoNoise, bench: FlatBench, wanted: FramePlan) -> list[Gate]:
    """Compare what the files of one ISO told with the camera file."""
    planned, where = bench.planned, f"ISO {bench.iso}"
    gain_dn_per_e = expected_gain(bench.camera, bench.iso, planned)
    read_dn, row_dn = read_noise_dn(planned), math.sqrt(max(dark_variance(planned) - dark_variance(planned, rows=False), 0.0))
    reason, error = no_read_noise_gate(planned, read_dn), found.gain.standard_error / found.gain.value
    read_error = found.dark.error_dn2 / (2.0 * read_dn**2) if read_dn > 0 else 0.0
    span_dn = planned.white_level_dn() - planned.moments(0.0).mean
    full_scale_e = span_dn / gain_dn_per_e
    smallest_e = math.sqrt(dark_variance(planned, rows=False)) / gain_dn_per_e + 0.5
    return [
        Gate("K", where, found.gain.value, gain_dn_per_e, GAIN_TOLERANCE, error, "DN/e-", ungated=_imprecise(wanted)),
        Gate("read noise", where, found.read_noise_dn, read_dn, READ_NOISE_TOLERANCE, read_error, "DN", ungated=reason),
        Gate("full scale", where, found.full_scale_e, full_scale_e, FULL_SCALE_TOLERANCE, error, "e-"),
        Gate(
            "dynamic range",
            where,
            found.dynamic_range_stops,
            math.log2(full_scale_e / smallest_e),
            RANGE_TOLERANCE_STOPS,
            read_error / math.log(2.0),
            "stops",
            relative=False,
            ungated=reason,
        ),
        _row_gate(where, found.row_noise_dn, row_dn, read_dn, planned, reason),
    ]


def _row_gate(where: str, measured_dn: float, row_dn: float, read_dn: float, planned: Plan, reason: str) -> Gate:
    """Row noise: few rows tell it, so the gate is as wide as chance makes it."""
    if row_dn == 0:
        return Gate("row noise", where, measured_dn, 0.0, 0.0, 0.0, "DN", ungated=reason or "the camera has none")
    of_photosites = read_dn**2 / planned.frame.width / row_dn**2  # what the mean of a row keeps of it
    error = (1.0 + of_photosites) / math.sqrt(2.0 * DARK_PAIRS * (planned.frame.height - 1))
    if planned.stage("banding") is not None:
        reason = reason or "banding is part of it, whose rows are not independent"
    return Gate("row noise", where, measured_dn, row_dn, LEAST_SIGMAS * error, error, "DN", ungated=reason)


def table_gates(found: Sequence[IsoNoise], gains: dict[int, float], read_noise_e: dict[int, float]) -> list[Gate]:
    """Compare what the ISOs tell together: the slope of K on ISO, and each switch of conversion gain.

    gains [DN/e-], read_noise_e [e-]: by ISO, of the camera file.
    """
    by_iso, gates = {one.iso: one for one in found}, []
    isos = sorted(by_iso)
    if len(isos) > 1:
        slope, spread = log_slope(isos, [gains[iso] for iso in isos]), np.log(isos) - np.mean(np.log(isos))
        error = np.linalg.norm(spread * [by_iso[iso].gain.standard_error / gains[iso] for iso in isos]) / (spread @ spread)
        proportional = abs(slope - 1.0) < 1e-4
        where = f"ISO {isos[0]} to {isos[-1]}" + ("" if proportional else ", slope of the file's own table")
        measured = log_slope(isos, [by_iso[iso].gain.value for iso in isos])
        expected = 1.0 if proportional else slope
        reason = "" if LEAST_SIGMAS * error <= SLOPE_TOLERANCE else "these ISOs lie too close to each other to tell a slope"
        gate = Gate("slope of ln K", where, measured, expected, SLOPE_TOLERANCE, float(error), relative=False, ungated=reason)
        gates.append(gate)
    for low, high in noise_steps({iso: read_noise_e[iso] for iso in isos}):
        first, second = by_iso[low], by_iso[high]
        error = math.hypot(*(part for one in (first, second) for part in _relative_errors(one)))
        measured, expected = first.read_noise_e / second.read_noise_e, read_noise_e[low] / read_noise_e[high]
        gates.append(Gate("step of read noise", f"ISO {low} to {high}", measured, expected, STEP_TOLERANCE, error, "e-/e-"))
    return gates


def _relative_errors(one: IsoNoise) -> tuple[float, float]:
    """Relative standard errors of K and of the read noise in DN."""
    return one.gain.standard_error / one.gain.value, one.dark.error_dn2 / (2.0 * one.read_noise_dn**2)


def expected_gain(camera: Camera, iso: int, planned: Plan) -> float:
    """K of the camera file at an ISO, times the digital gain if there is one [DN/e-]."""
    digital = planned.stage("digital_gain")
    return camera.iso_setting(iso).gain_dn_per_e * (digital.factor if digital is not None else 1.0)


def read_noise_dn(planned: Plan) -> float:
    """Temporal noise of a photosite in the dark, of the camera's stages, without row noise and rounding [DN]."""
    return math.sqrt(max(dark_variance(planned, rows=False) - 1.0 / 12.0, 0.0))


def dark_variance(planned: Plan, rows: bool = True) -> float:
    """Temporal variance of a dark code [DN^2]; rows: whether what whole rows share is part of it."""
    signal = Moments(0.0, 0.0)
    for stage in planned.stages:
        if stage.stem in STAGES and (rows or stage.stem not in OF_WHOLE_ROWS):
            signal = stage.moments(signal)
    return signal.variance


def no_read_noise_gate(planned: Plan, read_dn: float) -> str:
    """Why the read noise cannot be asked of the files, or nothing."""
    if read_dn < LEAST_READ_NOISE_DN:
        return f"below {LEAST_READ_NOISE_DN} DN, where rounding hides it"
    pedestal = planned.moments(0.0).mean
    if pedestal < CLEAR_SIGMAS * read_dn:
        return f"the pedestal of {pedestal:g} DN is below {CLEAR_SIGMAS:g} standard deviations: the file clips the dark"
    return ""


def _imprecise(wanted: FramePlan) -> str:
    """Why K cannot be asked of this many frames, or nothing."""
    error = LEAST_SIGMAS * wanted.gain_error
    return f"shot noise is so weak that {LEAST_SIGMAS:g} standard errors are {100 * error:.2g} %" if error > 0.0061 else ""
