"""The body behind the ISO settings: sources of read noise, fixed patterns, dark current, levels."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simulator.calibration.checks import findings
from simulator.calibration.frames import Frame, IsoFrames
from simulator.calibration.iso_measurement import NORMAL_SHAPE, IsoMeasurement, codes_of, measure_iso
from simulator.measurement.dark_current import slope_over_time
from simulator.measurement.interval import Interval, quotient
from simulator.measurement.pairs import pair_noise
from simulator.measurement.two_source import TwoSource, conversion_gain_switch, two_source

SHAPE_MARGIN = 0.02


@dataclass(frozen=True)
class Calibration:
    """Everything measured of a camera.

    isos: results by ISO, ascending. sources: the two-source fit, one per conversion gain. switch_iso: first ISO of the second.
    dsnu_e [e-], prnu (relative), column_dn [DN], dark_current_e_per_s [e-/s]: from the ISO that tells it best; None where no
    frames tell. hot_share, hot_excess_dn: of the same ISO as dsnu_e, at dark_time_s. white_level_dn: where flats clip.
    has_shape: whether some ISO's read noise is told from a normal one. notes: what the user should know.
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
    white_level_dn: int | None
    has_shape: bool
    notes: list[str]

    @property
    def first_frame(self) -> Frame:
        """A frame that tells size and pattern."""
        return self.isos[0].frames.short_darks[0]


def measure_camera(groups: list[IsoFrames], told: Callable[[int], object] = lambda iso: None) -> Calibration:
    """Measure every ISO and put the body together; `told` is called with each ISO as it is done.

    groups: as `checks.problems` lets through. Raises PhotositeError for frames that cannot be measured.
    """
    measured = []
    for group in groups:
        measured.append(measure_iso(group))
        told(group.iso)
    sources, switch_iso = _sources(measured)
    quiet = min(measured, key=lambda one: _width(one.pattern.photosite_dn) / one.gain_dn_per_e.value)
    columns = min(measured, key=lambda one: _width(one.pattern.column_dn))
    prnus = [one.prnu for one in measured if one.prnu is not None]
    current, current_notes = _dark_current(measured)
    clipped = [one.clipped_dn for one in measured if one.clipped_dn is not None]
    return Calibration(
        isos=measured,
        sources=sources,
        switch_iso=switch_iso,
        dsnu_e=quotient(quiet.pattern.photosite_dn, quiet.gain_dn_per_e),
        prnu=min(prnus, key=_width) if prnus else None,
        column_dn=columns.pattern.column_dn,
        hot_share=quiet.pattern.hot_share,
        hot_excess_e=quiet.pattern.hot_excess_dn / quiet.gain_dn_per_e.value,
        dark_time_s=quiet.frames.short_darks[0].time_s,
        dark_current_e_per_s=current,
        white_level_dn=max(clipped) if clipped else None,
        has_shape=any(one.shape is not None and _differs(one.shape.shape) for one in measured),
        notes=findings(measured) + current_notes,
    )


def _differs(shape: Interval) -> bool:
    """Whether a shape differs from a normal one so that it matters: by an excess kurtosis of about 0.1."""
    return shape.low > NORMAL_SHAPE + SHAPE_MARGIN or shape.high < NORMAL_SHAPE - SHAPE_MARGIN


def _width(interval: Interval) -> float:
    return interval.high - interval.low


def _sources(measured: list[IsoMeasurement]) -> tuple[list[TwoSource], int | None]:
    """Fit the two sources on each side of a conversion-gain switch."""
    isos = [one.iso for one in measured]
    switch = conversion_gain_switch(isos, [one.read_noise_e.value for one in measured])
    sides = [
        [one for one in measured if switch is None or one.iso < switch],
        [one for one in measured if switch and one.iso >= switch],
    ]
    fits = []
    for side in filter(None, sides):
        gains, sigmas = [one.gain_dn_per_e.value for one in side], [one.read_noise_dn for one in side]
        fits.append(two_source([one.iso for one in side], gains, sigmas))
    return fits, switch


def _dark_current(measured: list[IsoMeasurement]) -> tuple[Interval | None, list[str]]:
    """Dark current of the ISO with the most exposure times: growth of the mean of dark frames, EMVA 1288 R4.0 Linear.

    A camera that takes the mean of its covered photosites off shows none there. The shot noise of the dark current cannot be
    taken off, so the growth of the variance tells then.
    """
    best = max(measured, key=lambda one: (len(one.frames.darks), sum(map(len, one.frames.darks.values())), one.iso))
    frames = [frame for same in best.frames.darks.values() for frame in same]
    if len(best.frames.darks) < 2 or len(frames) < 3:
        return None, []
    slope, _ = slope_over_time(np.array([f.time_s for f in frames]), np.array([f.mean_dn for f in frames]))
    if slope.low > 0:
        return quotient(slope, best.gain_dn_per_e), []
    variances = [
        (time, pair_noise(codes_of(first), codes_of(second)).pixel_variance_dn2)
        for time, same in best.frames.darks.items()
        for first, second in zip(same[0::2], same[1::2], strict=False)
    ]
    if len(variances) > 2 and len({time for time, _ in variances}) > 1:
        growth, _ = slope_over_time(*np.array(variances).T)
        if growth.low > 0:
            rule = "the camera takes the mean of the dark current off; its rate is told by the variance"
            return quotient(quotient(growth, best.gain_dn_per_e), best.gain_dn_per_e), [f"ISO {best.iso}: {rule}"]
    rule = "no dark current, or too little to see; give dark frames of minutes, two or more of each time"
    return None, [
        f"ISO {best.iso}: dark frames do not change with the exposure time up to {max(best.frames.darks):g} s: {rule}"
    ]


def full_scale_e(one: IsoMeasurement, white_level_dn: float) -> float:
    """Electrons that fill the range of the ADC at an ISO [e-]."""
    return (white_level_dn - one.black_level_dn) / one.gain_dn_per_e.value


def dynamic_range_stops(one: IsoMeasurement, white_level_dn: float) -> float:
    """Stops between full scale and read noise, log2(full scale / sigma_e)."""
    return math.log2(full_scale_e(one, white_level_dn) / max(one.read_noise_e.value, 1e-9))
