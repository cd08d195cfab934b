"""EMVA 1288 Release 4.0 Linear for one colour plane: the numbers of its summary sheet from frame pairs and frame stacks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.statistics.interval import Interval, normal_interval
from simulator.measurement.statistics.linearity import Linearity, linearity, responsivity
from simulator.measurement.statistics.photon_transfer import (
    LARGEST_SHARE,
    DarkNoise,
    dynamic_range,
    gain,
    gain_without_dark,
    points_below_saturation,
    read_noise_e,
    saturation_index,
    transfer_point,
)
from simulator.measurement.statistics.spatial_variance import SpatialVariance, Stack, spatial_variance
from simulator.measurement.statistics.temporal_noise import PairNoise


@dataclass(frozen=True)
class LightStep:
    """Temporal noise of a pair of frames, and the mean photons on the whole area of a photosite (mu_p)."""

    photons: float
    noise: PairNoise


@dataclass(frozen=True)
class Nonuniformity:
    """DSNU [e-] or PRNU (relative): standard deviations in total, of rows, of columns and of photosites.

    error: standard error of `pixel`. A component whose estimated variance is negative is 0.
    """

    total: float
    row: float
    column: float
    pixel: float
    error: float


@dataclass(frozen=True)
class EmvaPlane:
    """Results of one plane.

    gain: K [DN/e-]. responsivity_dn: R [DN/photon]. quantum_efficiency: eta = R / K. dark: temporal, per frame.
    read_noise: sigma_d [e-]. saturation_photons, saturation_e: at the largest variance. dsnu [e-], prnu: relative.
    photons, signal_dn, variance_dn2: (steps,) the curves, in ascending order of light.
    """

    gain: Interval
    responsivity_dn: float
    quantum_efficiency: Interval
    dark: DarkNoise
    read_noise: Interval
    saturation_photons: float
    saturation_e: float
    dsnu: Nonuniformity
    prnu: Nonuniformity
    linearity: Linearity
    linearity_error: float
    photons: np.ndarray
    signal_dn: np.ndarray
    variance_dn2: np.ndarray

    @property
    def snr_max(self) -> float:
        """Largest SNR, sqrt(mu_e.sat)."""
        return math.sqrt(self.saturation_e)

    @property
    def threshold_photons(self) -> float:
        """mu_p.min: photons at which the SNR is 1, (sigma_y.dark / K + 1/2) / eta."""
        return self.saturation_photons / self.dynamic_range

    @property
    def dynamic_range(self) -> float:
        """mu_p.sat / mu_p.min."""
        return dynamic_range(self.saturation_e, self.dark, self.gain.value)

    def snr(self, photons: np.ndarray, fixed_pattern: bool = False) -> np.ndarray:
        """SNR of the linear model at these photons, of temporal noise, or with DSNU and PRNU (EMVA 1288: total SNR)."""
        electrons = self.quantum_efficiency.value * photons
        noise = self.dark.variance_dn2 / self.gain.value**2 + electrons
        if fixed_pattern:
            noise = noise + self.dsnu.total**2 + (self.prnu.total * electrons) ** 2
        return electrons / np.sqrt(noise)


def measure_plane(
    steps: Sequence[LightStep], dark: DarkNoise, dark_stack: Stack, light_stack: Stack, dark_is_clipped: bool = False
) -> EmvaPlane:
    """Measure a plane from pairs at steps of light, and from stacks in the dark and at half saturation.

    dark: of pairs at the same exposure time. dark_is_clipped: dark codes are clipped at 0; dark.mean_dn is the black level
        then, and K is the slope of the light steps with a free intercept.
    Raises PhotositeError when the steps do not reach from below 70 % of saturation to saturation.
    """
    ordered = sorted(steps, key=lambda step: step.photons)
    points = [transfer_point(step.noise, dark.mean_dn) for step in ordered]
    last = saturation_index(points)
    if last == len(points) - 1:
        raise PhotositeError("EMVA 1288: the variance still rises at the last step of light; add steps beyond saturation")
    fitted = points_below_saturation(points, points[last].signal_dn)
    slope = gain_without_dark(fitted) if dark_is_clipped else gain(fitted, dark)
    photons = np.array([step.photons for step in ordered])
    signal_dn = np.array([point.signal_dn for point in points])
    low = signal_dn <= LARGEST_SHARE * signal_dn[last]
    response = responsivity(photons[low], signal_dn[low])
    line = linearity(photons, signal_dn, signal_dn[last])
    dsnu, prnu = measure_nonuniformity(dark_stack, light_stack, slope.value)
    efficiency = response / slope.value
    mean_error = np.array([step.noise.mean_error_dn for step in ordered]) / np.maximum(signal_dn, 1e-12)
    return EmvaPlane(
        gain=slope,
        responsivity_dn=response,
        quantum_efficiency=normal_interval(efficiency, efficiency * slope.standard_error / slope.value),
        dark=dark,
        read_noise=_read_noise(dark, slope),
        saturation_photons=float(photons[last]),
        saturation_e=float(photons[last]) * efficiency,
        dsnu=dsnu,
        prnu=prnu,
        linearity=line,
        linearity_error=float(mean_error[np.isin(photons, line.photons)].max()),
        photons=photons,
        signal_dn=signal_dn,
        variance_dn2=np.array([point.variance_dn2 for point in points]),
    )


def _read_noise(dark: DarkNoise, slope: Interval) -> Interval:
    """sigma_d with its standard error; 0 where the dark variance is that of rounding or less."""
    value = read_noise_e(dark, slope.value)
    if value == 0.0:
        return Interval(0.0, 0.0, 0.0)
    of_dark = dark.error_dn2 / (2.0 * (value * slope.value) ** 2)
    return normal_interval(value, value * math.hypot(of_dark, slope.standard_error / slope.value))


def measure_nonuniformity(dark: Stack, light: Stack, gain_dn_per_e: float) -> tuple[Nonuniformity, Nonuniformity]:
    """Measure DSNU [e-] and PRNU (relative) from the spatial variances of a dark stack and a light stack.

    DSNU = s_y.dark / K, PRNU = sqrt(s_y.light^2 - s_y.dark^2) / (mu_y.light - mu_y.dark), for each component of the variance.
    """
    in_dark, in_light = spatial_variance(dark), spatial_variance(light)
    signal_dn = float(light.mean_dn.mean() - dark.mean_dn.mean())
    added = [getattr(in_light, part) - getattr(in_dark, part) for part in _PARTS]
    dark_error, light_error = _error(in_dark, dark), _error(in_light, light)
    dsnu = _nonuniformity_of([getattr(in_dark, part) for part in _PARTS], dark_error, gain_dn_per_e)
    return dsnu, _nonuniformity_of(added, math.hypot(dark_error, light_error), signal_dn)


_PARTS = ("total_dn2", "row_dn2", "column_dn2", "pixel_dn2")


def _error(variance: SpatialVariance, stack: Stack) -> float:
    """Standard error of the photosites' spatial variance, whose estimate includes 1/L of the temporal variance [DN^2]."""
    return math.sqrt(2.0 / stack.mean_dn.size) * (max(variance.pixel_dn2, 0.0) + stack.variance_dn2 / stack.frames)


def _nonuniformity_of(variances: list[float], error: float, unit: float) -> Nonuniformity:
    """Convert the variances of the four components to standard deviations in another unit."""
    total, row, column, pixel = (math.sqrt(max(value, 0.0)) / unit for value in variances)
    # Standard error of a square root; at a variance of 0 it is the root of the variance's error.
    of_root = error / (2.0 * max(pixel * unit, math.sqrt(error)) * unit) if error > 0 else 0.0
    return Nonuniformity(total, row, column, pixel, of_root)
