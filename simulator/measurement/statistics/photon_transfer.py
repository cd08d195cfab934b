"""Photon transfer: the gain K is the slope of the temporal variance over the mean (EMVA 1288 R4.0 Linear).

sigma_y^2 - sigma_y.dark^2 = K (mu_y - mu_y.dark), since the number of electrons has a Poisson distribution.
A `TransferPoint` is one pair of flat frames in one colour plane. Points of several planes may be fitted together, because
one amplifier chain reads all planes; the dark signal of its own plane is subtracted from each point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.statistics.interval import Interval, normal_interval
from simulator.measurement.statistics.temporal_noise import PairNoise

LARGEST_SHARE = 0.7  # of saturation: EMVA 1288 fits up to here, where full well and ADC do not yet reduce the variance


@dataclass(frozen=True)
class TransferPoint:
    """One point of the photon transfer curve.

    signal_dn: mean above the dark signal [DN]. variance_dn2: temporal variance, dark noise included [DN^2].
    error_dn2: its standard error [DN^2].
    """

    signal_dn: float
    variance_dn2: float
    error_dn2: float


@dataclass(frozen=True)
class DarkNoise:
    """Mean [DN] and temporal variance [DN^2] of pairs of dark frames, with the variance's standard error [DN^2]."""

    mean_dn: float
    variance_dn2: float
    error_dn2: float


def dark_noise(pairs: Sequence[PairNoise], row_noise: bool = True) -> DarkNoise:
    """Average pairs of dark frames of one size; row_noise: whether row noise is part of the variance, as in EMVA 1288.

    Raises PhotositeError without a pair.
    """
    if not pairs:
        raise PhotositeError("no pair of dark frames: give two at least, taken with the lens cap on")
    variances, errors = zip(*(_variance(pair, row_noise) for pair in pairs), strict=True)
    error = float(np.linalg.norm(errors)) / len(pairs)
    return DarkNoise(float(np.mean([pair.mean_dn for pair in pairs])), float(np.mean(variances)), error)


def transfer_point(pair: PairNoise, dark_mean_dn: float, row_noise: bool = True) -> TransferPoint:
    """Return the photon transfer point of a pair of flat frames. dark_mean_dn: mean of the same plane in the dark [DN]."""
    return TransferPoint(pair.mean_dn - dark_mean_dn, *_variance(pair, row_noise))


def _variance(pair: PairNoise, row_noise: bool) -> tuple[float, float]:
    if row_noise:
        return pair.variance_dn2, pair.variance_error_dn2
    return pair.pixel_variance_dn2, pair.pixel_variance_error_dn2


def gain(points: Sequence[TransferPoint], dark: DarkNoise) -> Interval:
    """Return K [DN/e-]: slope of the variance above that of the dark over the signal, on a line through 0.

    The standard error of a sample variance is proportional to the variance, so points are weighted by 1 / variance^2 of the
    fitted line (weights of the measured variance would favour points that are low by chance). EMVA 1288 R4.0 Linear weights
    all points equally, which is unbiased too, but needs 1.8 times the frames for the same precision (evenly spaced levels,
    shot noise only). Raises PhotositeError without a point above dark.
    """
    signal, variance, error = _columns(points)
    rise = variance - dark.variance_dn2
    slope, leverage = float(signal @ rise / (signal @ signal)), np.zeros_like(signal)
    for _ in range(3):
        weight = 1.0 / np.maximum(dark.variance_dn2 + slope * signal, 1e-12) ** 2
        leverage = weight * signal / float(weight @ signal**2)
        slope = float(leverage @ rise)
    # The same dark variance is subtracted from all points, so its error does not average out.
    return normal_interval(slope, float(np.hypot(np.linalg.norm(leverage * error), leverage.sum() * dark.error_dn2)))


def gain_without_dark(points: Sequence[TransferPoint]) -> Interval:
    """Return K [DN/e-] as the slope of a line with a free intercept, for cameras whose dark frames are clipped at code 0.

    The signal of a point is the mean above the black level; all points must lie well above the clipping.
    Raises PhotositeError with fewer than two different signals.
    """
    return line_without_dark(points)[0]


def line_without_dark(points: Sequence[TransferPoint]) -> tuple[Interval, Interval]:
    """Return slope K [DN/e-] and intercept, the variance without light [DN^2], of the line of `gain_without_dark`."""
    signal, variance, error = _columns(points)
    if np.ptp(signal) == 0:
        raise PhotositeError("photon transfer of a camera without pedestal: needs flat pairs at two or more levels")
    slope, offset = np.polyfit(signal, variance, 1)
    weight = leverage = np.zeros_like(signal)
    for _ in range(3):
        weight = 1.0 / np.maximum(offset + slope * signal, 1e-12) ** 2
        weight /= weight.sum()
        about = signal - float(weight @ signal)
        leverage = weight * about / float(weight @ about**2)
        slope = float(leverage @ variance)
        offset = float(weight @ (variance - slope * signal))
    of_offset = weight - float(weight @ signal) * leverage
    slope_error, offset_error = (float(np.linalg.norm(part * error)) for part in (leverage, of_offset))
    return normal_interval(slope, slope_error), normal_interval(offset, offset_error)


def _columns(points: Sequence[TransferPoint]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    good = [point for point in points if point.signal_dn > 0]
    if not good:
        raise PhotositeError("photon transfer: no flat pair is brighter than the dark frames; give flats with more light")
    rows = [(point.signal_dn, point.variance_dn2, point.error_dn2) for point in good]
    signal, variance, error = np.array(rows, dtype=np.float64).T
    return signal, variance, error


def points_below_saturation(points: Sequence[TransferPoint], saturation_dn: float) -> list[TransferPoint]:
    """Return the points whose signal is at most LARGEST_SHARE of the saturation signal [DN]."""
    return [point for point in points if point.signal_dn <= LARGEST_SHARE * saturation_dn]


def saturation_index(points: Sequence[TransferPoint]) -> int:
    """Return the index of the saturation point: the largest variance (EMVA 1288), points in ascending order of light.

    Beyond it, clipping by full well or ADC reduces the variance. It is the last index where no point is clipped.
    """
    return int(np.argmax([point.variance_dn2 for point in points]))


def read_noise_e(dark: DarkNoise, gain_dn_per_e: float) -> float:
    """Return sigma_d [e-]: temporal dark noise less the 1/12 DN^2 of rounding (EMVA 1288); 0 below that variance."""
    return float(np.sqrt(max(dark.variance_dn2 - 1.0 / 12.0, 0.0))) / gain_dn_per_e


def dynamic_range(saturation_e: float, dark: DarkNoise, gain_dn_per_e: float) -> float:
    """Return the ratio of saturation to the signal of SNR 1, which is sigma_y.dark / K + 1/2 electrons (EMVA 1288)."""
    return saturation_e / (float(np.sqrt(dark.variance_dn2)) / gain_dn_per_e + 0.5)
