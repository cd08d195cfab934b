"""Tolerance checks of the noise measured from raw files against the camera file."""

import math
from collections.abc import Sequence

import numpy as np

from simulator.measurement.noise_check.expected import (
    dark_moments,
    expected_gain,
    read_noise_dn,
    reason_gain_is_unmeasurable,
    reason_linearity_is_unmeasurable,
    reason_read_noise_is_unmeasurable,
    row_noise_dn,
)
from simulator.measurement.noise_check.flat_bench import FlatBench
from simulator.measurement.noise_check.frames import DARK_PAIRS, FramePlan
from simulator.measurement.noise_check.measure import IsoNoise, log_slope, noise_steps
from simulator.measurement.report.tolerance_check import LEAST_SIGMAS, ToleranceCheck

GAIN_TOLERANCE = 0.006
READ_NOISE_TOLERANCE = 0.015
FULL_SCALE_TOLERANCE = 0.006
RANGE_TOLERANCE_STOPS = 0.03  # 2 %
SLOPE_TOLERANCE = 0.005
STEP_TOLERANCE = 0.03


def check_iso(found: IsoNoise, bench: FlatBench, wanted: FramePlan) -> list[ToleranceCheck]:
    """Compare the numbers measured at one ISO with the camera file."""
    sensor, where, reason = bench.sensor, f"ISO {bench.iso}", reason_read_noise_is_unmeasurable(bench.sensor)
    gain_dn_per_e, read_dn = expected_gain(bench.camera, bench.iso, sensor), read_noise_dn(sensor)
    error = found.gain.standard_error / found.gain.value
    read_error = found.dark.error_dn2 / (2.0 * read_dn**2) if read_dn > 0 else 0.0
    full_scale_e = (sensor.white_level_dn() - sensor.moments(0.0).mean) / gain_dn_per_e
    smallest_e = math.sqrt(dark_moments(sensor, rows=False).variance) / gain_dn_per_e + 0.5
    stops, gain_reason = (
        math.log2(full_scale_e / smallest_e),
        reason_gain_is_unmeasurable(sensor) or reason_linearity_is_unmeasurable(sensor) or _imprecise(wanted),
    )
    range_error = math.hypot(read_error, error) / math.log(2.0)
    checks = [
        ToleranceCheck(
            "K",
            where,
            found.gain.value,
            gain_dn_per_e,
            max(GAIN_TOLERANCE, LEAST_SIGMAS * error),
            error,
            "DN/e-",
            reason_unchecked=gain_reason,
        ),
        ToleranceCheck(
            "read noise",
            where,
            found.read_noise_dn,
            read_dn,
            max(READ_NOISE_TOLERANCE, LEAST_SIGMAS * read_error),
            read_error,
            "DN",
            reason_unchecked=reason,
        ),
        ToleranceCheck(
            "full scale",
            where,
            found.full_scale_e,
            full_scale_e,
            max(FULL_SCALE_TOLERANCE, LEAST_SIGMAS * error),
            error,
            "e-",
            reason_unchecked=gain_reason,
        ),
        ToleranceCheck(
            "dynamic range",
            where,
            found.dynamic_range_stops,
            stops,
            max(RANGE_TOLERANCE_STOPS, LEAST_SIGMAS * range_error),
            range_error,
            "stops",
            relative=False,
            reason_unchecked=reason or gain_reason,
        ),
    ]
    return [*checks, _check_row_noise(where, found.row_noise_dn, bench, reason)]


def _check_row_noise(where: str, measured_dn: float, bench: FlatBench, reason: str) -> ToleranceCheck:
    """Check the row noise; its tolerance follows from its standard error, because a frame has few rows."""
    row_dn, read_dn, frame = row_noise_dn(bench.sensor), read_noise_dn(bench.sensor), bench.camera.frame
    if row_dn == 0:
        return ToleranceCheck(
            "row noise", where, measured_dn, 0.0, 0.0, 0.0, "DN", reason_unchecked=reason or "the camera has none"
        )
    of_photosites = read_dn**2 / frame.width / row_dn**2  # share of the photosites' noise left in a row's mean
    error = (1.0 + of_photosites) / math.sqrt(2.0 * DARK_PAIRS * (frame.height - 1))
    if LEAST_SIGMAS * error > 0.5:
        reason = reason or "too little of it to be told from the photosites' noise"
    for stage in bench.sensor.stages:
        if not stage.rows_are_independent:
            reason = reason or f"{stage.stem} is part of it, whose rows are not independent"
    return ToleranceCheck("row noise", where, measured_dn, row_dn, LEAST_SIGMAS * error, error, "DN", reason_unchecked=reason)


def check_iso_table(found: Sequence[IsoNoise], gains: dict[int, float], read_noise_e: dict[int, float]) -> list[ToleranceCheck]:
    """Check what follows from several ISOs: the slope of K over ISO, and each switch of conversion gain.

    gains [DN/e-], read_noise_e [e-]: by ISO, of the camera file.
    """
    by_iso, checks = {one.iso: one for one in found}, []
    isos = sorted(by_iso)
    if len(isos) > 1:
        slope, spread = log_slope(isos, [gains[iso] for iso in isos]), np.log(isos) - np.mean(np.log(isos))
        error = np.linalg.norm(spread * [by_iso[iso].gain.standard_error / gains[iso] for iso in isos]) / (spread @ spread)
        proportional = abs(slope - 1.0) < 1e-4
        where = f"ISO {isos[0]} to {isos[-1]}" + ("" if proportional else ", slope of the file's own table")
        measured = log_slope(isos, [by_iso[iso].gain.value for iso in isos])
        expected = 1.0 if proportional else slope
        reason = "" if LEAST_SIGMAS * error <= SLOPE_TOLERANCE else "these ISOs lie too close to each other to tell a slope"
        check = ToleranceCheck(
            "slope of ln K", where, measured, expected, SLOPE_TOLERANCE, float(error), relative=False, reason_unchecked=reason
        )
        checks.append(check)
    for low, high in noise_steps({iso: read_noise_e[iso] for iso in isos}):
        first, second = by_iso[low], by_iso[high]
        error = math.hypot(*(part for one in (first, second) for part in _relative_errors(one)))
        measured, expected = first.read_noise_e / second.read_noise_e, read_noise_e[low] / read_noise_e[high]
        tolerance = max(STEP_TOLERANCE, LEAST_SIGMAS * error)
        checks.append(
            ToleranceCheck("step of read noise", f"ISO {low} to {high}", measured, expected, tolerance, error, "e-/e-")
        )
    return checks


def _relative_errors(one: IsoNoise) -> tuple[float, float]:
    """Relative standard errors of K and of the read noise in DN."""
    return one.gain.standard_error / one.gain.value, one.dark.error_dn2 / (2.0 * one.read_noise_dn**2)


def _imprecise(wanted: FramePlan) -> str:
    """Return why K, and what is divided by it, cannot be checked with this number of frames, or an empty string."""
    error = LEAST_SIGMAS * wanted.gain_error
    return f"shot noise is so weak that {LEAST_SIGMAS:g} standard errors are {100 * error:.2g} %" if error > 0.0061 else ""
