"""Calibration of a camera from the measurements of all its ISO settings: read noise sources, fixed pattern, dark current."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.measurement.calibration.dark_measurement import NORMAL_SHAPE
from simulator.measurement.calibration.frame_checks import findings
from simulator.measurement.calibration.frame_sorting import Frame, IsoFrames
from simulator.measurement.calibration.iso_measurement import IsoMeasurement, measure_iso, read_codes, without_dark_current
from simulator.measurement.statistics.dark_current import fit_slope_over_time
from simulator.measurement.statistics.interval import Interval, quotient
from simulator.measurement.statistics.read_noise import ROUNDING_VARIANCE_DN2
from simulator.measurement.statistics.read_noise_split import TwoSource, find_conversion_gain_switch, fit_two_sources
from simulator.measurement.statistics.signal_to_noise import least_signal_e
from simulator.measurement.statistics.temporal_noise import pair_noise
from simulator.progress import Progress, Steps, silent

SHAPE_MARGIN = 0.02
LARGEST_MISS = 0.25  # of sigma; a larger deviation of the two-source model is reported


@dataclass(frozen=True)
class Calibration:
    """Everything measured of a camera.

    isos: results by ISO, ascending, without the dark current where one is told. sources: the two-source fit, one per
    conversion gain. switch_iso: first ISO of the second.
    dsnu_e [e-], prnu (relative), column_dn [DN], dark_current_e_per_s [e-/s]: from the ISO with the smallest interval; None
    where no frames allow the measurement. hot_share, hot_excess_e: at the ISO of dsnu_e and the exposure time dark_time_s [s].
    white_levels_dn: by ISO, the code at which flats clip, else the level in the files' metadata; white_is_measured: whether
    some flat clips. has_shape: whether some ISO's read noise differs from a normal distribution. notes: messages to the user.
    """

    isos: list[IsoMeasurement]
    sources: list[TwoSource]
    switch_iso: int | None
    dsnu_e: Interval
    prnu: Interval | None
    column_dn: Interval
    hot_share: float
    hot_excess_e: float
    dark_time_s: float
    dark_current_e_per_s: Interval | None
    white_levels_dn: dict[int, int]
    white_is_measured: bool
    has_shape: bool
    notes: list[str]

    @property
    def first_frame(self) -> Frame:
        """Frame from which the sensor's size and filter pattern are taken."""
        return self.isos[0].frames.short_darks[0]


def measure_camera(groups: list[IsoFrames], progress: Progress = silent) -> Calibration:
    """Measure every ISO and derive the camera's numbers from all of them. progress: counts the ISO settings.

    groups: those that `frame_checks.problems` returns. Raises PhotositeError for frames that cannot be measured.
    """
    measured, steps = [], Steps(progress, len(groups))
    for group in groups:
        measured.append(measure_iso(group))
        steps.add(f"measuring ISO {group.iso}")
    current, current_notes = _dark_current(measured)
    if current is not None:
        measured = [without_dark_current(one, current) for one in measured]
    sources, switch_iso = _sources(measured)
    whole = [one for one in measured if not one.frames.is_clipped_at_zero] or measured
    quiet = min(whole, key=lambda one: _width(one.dark.dsnu.photosite_dn) / one.gain_dn_per_e.value)
    columns = min(whole, key=lambda one: _width(one.dark.dsnu.column_dn))
    prnus = [one.prnu for one in measured if one.prnu is not None]
    return Calibration(
        isos=measured,
        sources=sources,
        switch_iso=switch_iso,
        dsnu_e=quotient(quiet.dark.dsnu.photosite_dn, quiet.gain_dn_per_e),
        prnu=min(prnus, key=_width) if prnus else None,
        column_dn=columns.dark.dsnu.column_dn,
        hot_share=quiet.dark.dsnu.hot_share,
        hot_excess_e=quiet.dark.dsnu.hot_excess_dn / quiet.gain_dn_per_e.value,
        dark_time_s=quiet.frames.short_darks[0].time_s,
        dark_current_e_per_s=current,
        white_levels_dn=_white_levels(measured),
        white_is_measured=any(one.clipped_dn is not None for one in measured),
        has_shape=_has_shape(measured),
        notes=findings(measured) + current_notes + _source_notes(sources),
    )


def _has_shape(measured: list[IsoMeasurement]) -> bool:
    """Whether the noise of some ISO differs from a normal distribution by an excess kurtosis of about 0.1 or more."""
    shapes = [one.dark.shape.shape for one in measured if one.dark.shape is not None]
    beyond = any(part.low > NORMAL_SHAPE + SHAPE_MARGIN or part.high < NORMAL_SHAPE - SHAPE_MARGIN for part in shapes)
    return beyond and all(one.dark.read_noise_dn.value > 0 for one in measured)


def _white_levels(measured: list[IsoMeasurement]) -> dict[int, int]:
    """White level by ISO [DN]. An ISO without clipped flats takes that of another ISO whose metadata hold the same level."""
    said = {one.iso: one.frames.usable_pairs[0][0].white_level_dn for one in measured}
    clipped = {said[one.iso]: one.clipped_dn for one in measured if one.clipped_dn is not None}
    return {one.iso: one.clipped_dn or clipped.get(said[one.iso], said[one.iso]) for one in measured}


def _source_notes(sources: list[TwoSource]) -> list[str]:
    rule = "the conversion gain may switch between, or the sensor is built otherwise; calibrate more ISOs to see"
    return [
        f"ISO {part.isos[0]} to {part.isos[-1]}: two sources miss the read noise by up to {100 * part.worst:.0f} %: {rule}"
        for part in sources
        if part.worst > LARGEST_MISS
    ]


def _width(interval: Interval) -> float:
    return interval.high - interval.low


def _sources(measured: list[IsoMeasurement]) -> tuple[list[TwoSource], int | None]:
    """Fit the two-source model of read noise to each side of a conversion-gain switch."""
    isos = [one.iso for one in measured]
    switch = find_conversion_gain_switch(isos, [one.read_noise_e.value for one in measured])
    sides = [
        [one for one in measured if switch is None or one.iso < switch],
        [one for one in measured if switch and one.iso >= switch],
    ]
    fits = []
    for side in filter(None, sides):
        gains, sigmas = [one.gain_dn_per_e.value for one in side], [one.dark.read_noise_dn for one in side]
        fits.append(fit_two_sources([one.iso for one in side], gains, sigmas))
    return fits, switch


def _dark_current(measured: list[IsoMeasurement]) -> tuple[Interval | None, list[str]]:
    """Dark current at the ISO with the most exposure times: slope of the mean of dark frames over time, EMVA 1288 R4.0 Linear.

    A camera that subtracts the mean of its optical black has no such slope. The shot noise of the dark current remains, so
    the slope of the temporal variance gives the dark current then. Frames that clip at 0 or white have neither slope.
    """
    darks_of = {one.iso: one.frames.unclipped_darks for one in measured}
    best = max(measured, key=lambda one: (len(darks_of[one.iso]), sum(map(len, darks_of[one.iso].values())), one.iso))
    darks = darks_of[best.iso]
    frames = [frame for same in darks.values() for frame in same]
    if len(darks) < 2 or len(frames) < 3:
        return None, []
    slope, _ = fit_slope_over_time(np.array([f.time_s for f in frames]), np.array([f.mean_dn for f in frames]))
    if slope.low > 0:
        return quotient(slope, best.gain_dn_per_e), []
    variances = [
        (time, pair_noise(read_codes(first), read_codes(second)).pixel_variance_dn2)
        for time, same in darks.items()
        for first, second in zip(same[0::2], same[1::2], strict=False)
    ]
    if len(variances) > 2 and len({time for time, _ in variances}) > 1:
        growth, _ = fit_slope_over_time(*np.array(variances).T)
        if growth.low > 0:
            rule = "the camera takes the mean of the dark current off; its rate is told by the variance"
            return quotient(quotient(growth, best.gain_dn_per_e), best.gain_dn_per_e), [f"ISO {best.iso}: {rule}"]
    rule = "no dark current, or too little to see; give dark frames of minutes, two or more of each time"
    return None, [f"ISO {best.iso}: dark frames do not change with the exposure time up to {max(darks):g} s: {rule}"]


def full_scale_e(one: IsoMeasurement, white_level_dn: float) -> float:
    """Return the electrons between black and white level at an ISO [e-]."""
    return (white_level_dn - one.dark.black_level_dn) / one.gain_dn_per_e.value


def range_stops(one: IsoMeasurement, white_level_dn: float, snr: float = 1.0) -> float:
    """Return the stops between full scale and the signal of an SNR; nan where no signal below full scale has it.

    Dynamic range at SNR 1: saturation capacity over absolute sensitivity threshold (EMVA 1288 R4.0 Linear). The dark noise is
    that of photosites and rows, rounding included.
    """
    variance_dn2 = one.dark.read_noise_dn.value**2 + one.dark.row_noise_dn.value**2 + ROUNDING_VARIANCE_DN2
    full_e, least_e = full_scale_e(one, white_level_dn), least_signal_e(math.sqrt(variance_dn2) / one.gain_dn_per_e.value, snr)
    return math.log2(full_e / least_e) if least_e < full_e else math.nan
