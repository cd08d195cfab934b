"""Tolerance checks of the EMVA 1288 numbers measured from raw files against the camera file."""

import math

import numpy as np
from scipy import stats

from simulator.color.spectra import efficiency_on
from simulator.measurement.emva1288.files_to_planes import COLOR_OF, EmvaCamera
from simulator.measurement.emva1288.frames import HALF, SHARES, EmvaBench
from simulator.measurement.emva1288.plane import Nonuniformity
from simulator.measurement.noise_check.checks import GAIN_TOLERANCE, READ_NOISE_TOLERANCE
from simulator.measurement.noise_check.expected import (
    LEAST_READ_NOISE_DN,
    dark_moments,
    expected_gain,
    reason_efficiency_is_unmeasurable,
    reason_gain_is_unmeasurable,
    reason_linearity_is_unmeasurable,
    reason_read_noise_is_unmeasurable,
)
from simulator.measurement.noise_check.flat_bench import FlatBench
from simulator.measurement.report.tolerance_check import LEAST_SIGMAS, ToleranceCheck
from simulator.sensor.sensor_plan import SensorPlan

EFFICIENCY_TOLERANCE = 0.005
SATURATION_TOLERANCE = 0.02  # the steps of light about it are 1 % apart
SNR_TOLERANCE = 0.01
RANGE_TOLERANCE = 0.03
LINEARITY_TOLERANCE = 0.05  # %
NONUNIFORMITY_TOLERANCE = 0.03
LEAST_PRNU = 0.005
DARK_CURRENT_TOLERANCE = 0.02


def check_emva(found: EmvaCamera, bench: EmvaBench) -> list[ToleranceCheck]:
    """Compare every plane with the camera file."""
    checks = []
    for name in found.planes:
        one = bench.colors[COLOR_OF[name]]
        checks += _check_temporal(name, found, bench, one) + _check_nonuniformity(name, found, bench, one.sensor)
        checks += _check_dark_current(name, found, bench)
    return checks


def _check_temporal(name: str, found: EmvaCamera, bench: EmvaBench, one: FlatBench) -> list[ToleranceCheck]:
    """Check K, quantum efficiency, dark noise, saturation, SNR, dynamic range and linearity."""
    plane, sensor = found.planes[name], one.sensor
    gain_dn_per_e, efficiency = expected_gain(bench.camera, bench.iso, sensor), _efficiency(name, found, bench)
    dark_dn2 = dark_moments(sensor).variance
    saturation_e, step_error = _saturation_e(one, found.dark_stacks[name].mean_dn.size)
    sigma_d = math.sqrt(max(dark_dn2 - 1.0 / 12.0, 0.0)) / gain_dn_per_e
    k_error = plane.gain.standard_error / plane.gain.value
    read_error = plane.read_noise.standard_error / sigma_d if sigma_d > 0 else 0.0
    saturation_error = math.hypot(k_error, step_error)
    ratio, range_error = saturation_e / (math.sqrt(dark_dn2) / gain_dn_per_e + 0.5), math.hypot(read_error, saturation_error)
    line, line_error, snr = plane.linearity, 100.0 * plane.linearity_error, math.sqrt(saturation_e)
    bend = max(LINEARITY_TOLERANCE, LEAST_SIGMAS * line_error)
    noise_reason, line_reason, eta = (
        reason_read_noise_is_unmeasurable(sensor),
        reason_linearity_is_unmeasurable(sensor),
        plane.quantum_efficiency.value,
    )
    k_reason, eta_reason = (
        reason_gain_is_unmeasurable(sensor) or line_reason,
        reason_efficiency_is_unmeasurable(sensor) or line_reason,
    )
    rows: list[tuple[str, float, float, float, float, str, str]] = [
        ("K", plane.gain.value, gain_dn_per_e, GAIN_TOLERANCE, k_error, "DN/e-", k_reason),
        ("quantum efficiency", eta, efficiency, EFFICIENCY_TOLERANCE, k_error, "e-/photon", eta_reason),
        ("sigma_d", plane.read_noise.value, sigma_d, READ_NOISE_TOLERANCE, read_error, "e-", noise_reason or k_reason),
        ("saturation", plane.saturation_e, saturation_e, SATURATION_TOLERANCE, saturation_error, "e-", k_reason),
        ("SNR_max", plane.snr_max, snr, SNR_TOLERANCE, saturation_error / 2.0, "", k_reason),
        ("dynamic range", plane.dynamic_range, ratio, RANGE_TOLERANCE, range_error, "", noise_reason or k_reason),
    ]
    checks = [
        ToleranceCheck(
            quantity, name, measured, expected, max(least, LEAST_SIGMAS * error), error, unit, reason_unchecked=reason
        )
        for quantity, measured, expected, least, error, unit, reason in rows
    ]
    for quantity, value in (("LE_min", line.least), ("LE_max", line.greatest)):
        checks.append(
            ToleranceCheck(
                quantity, name, 100.0 * value, 0.0, bend, line_error, "%", relative=False, reason_unchecked=line_reason
            )
        )
    return checks


def _efficiency(name: str, found: EmvaCamera, bench: EmvaBench) -> float:
    """Electrons per photon on the whole area of a photosite, by the camera file at the plane's wavelength."""
    camera = bench.camera
    wavelength_nm, response = np.array([found.wavelengths_nm[name]]), camera.response
    curves = efficiency_on(wavelength_nm, response.wavelengths_nm, response.quantum_efficiency)
    return float(curves[0, list(bench.colors).index(COLOR_OF[name])]) * camera.fill_factor


def _saturation_e(bench: FlatBench, photosites: int) -> tuple[float, float]:
    """Predict the electrons at the light step of largest temporal variance, which EMVA 1288 takes as saturation.

    The second number is the relative standard deviation from it of the step that is found, since the variance of a pair of
    so many photosites scatters by sqrt(2 / photosites) of it.

    The model is normal noise clipped at the white level. Its variance is averaged over photosites, whose mean signals
    scatter by the fixed pattern, which is taken as normal, too.
    """
    sensor, shares = bench.sensor, np.array(SHARES)
    white, dark, one = sensor.white_level_dn(), sensor.moments(0.0), sensor.moments(1.0)
    # Half saturation is far from the full well, where the stages' variance model no longer holds.
    half = sensor.moments(HALF * bench.saturation_e)
    rise = (half.variance - dark.variance) / (half.mean - dark.mean)
    signal = (one.mean - dark.mean) * shares * bench.saturation_e
    nodes, weights = np.polynomial.hermite_e.hermegauss(21)
    added = (half.fixed_variance - dark.fixed_variance) / (half.mean - dark.mean) ** 2
    fixed = np.sqrt(dark.fixed_variance + added * signal**2)
    mean = (dark.mean + signal)[:, np.newaxis] + fixed[:, np.newaxis] * nodes
    variance = _cut_variance(mean, np.sqrt(dark.variance + rise * np.maximum(mean - dark.mean, 0.0)), white)
    found = variance @ weights
    expected = float(shares[np.argmax(found)])
    chances = _chances_of_largest(found, math.sqrt(2.0 / photosites) * np.maximum(found, 1e-6 * found.max()))
    return expected * bench.saturation_e, math.sqrt(float(chances @ (shares / expected - 1.0) ** 2))


def _chances_of_largest(mean: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return for each of several independent normal numbers the chance that it is the largest."""
    values = np.linspace((mean - 8.0 * sigma).max(), (mean + 8.0 * sigma).max(), 4001)
    z = (values - mean[:, np.newaxis]) / sigma[:, np.newaxis]
    below = stats.norm.logcdf(z)
    density = np.exp(below.sum(axis=0) - below + stats.norm.logpdf(z)) / sigma[:, np.newaxis]
    chances = density.sum(axis=1)
    return np.asarray(chances / chances.sum())


def _cut_variance(mean: np.ndarray, spread: np.ndarray, top: float) -> np.ndarray:
    """Variance of min(x, top) for normal x."""
    z = (top - mean) / spread
    under, density = stats.norm.cdf(z), stats.norm.pdf(z)
    first = mean * under - spread * density + top * (1.0 - under)
    second = (mean**2 + spread**2) * under - spread * (top + mean) * density + top**2 * (1.0 - under)
    return second - first**2


def _check_nonuniformity(name: str, found: EmvaCamera, bench: EmvaBench, sensor: SensorPlan) -> list[ToleranceCheck]:
    """Check DSNU and PRNU against the fixed variances of the sensor's stages."""
    plane, gain_dn_per_e = found.planes[name], expected_gain(bench.camera, bench.iso, sensor)
    dark, half = sensor.moments(0.0), sensor.moments(HALF * bench.colors[COLOR_OF[name]].saturation_e)
    dsnu_dn = math.sqrt(dark.fixed_variance)
    prnu = math.sqrt(max(half.fixed_variance - dark.fixed_variance, 0.0)) / (half.mean - dark.mean)
    defects = any(stage.is_defect for stage in sensor.stages)
    few = "defect photosites are part of it, so few that chance decides" if defects else ""
    small = f"below {LEAST_READ_NOISE_DN} DN, where rounding hides it" if dsnu_dn < LEAST_READ_NOISE_DN else ""
    weak = f"below {100 * LEAST_PRNU} %" if prnu < LEAST_PRNU else ""
    dsnu_error, prnu_error = (
        _nonuniformity_error(one, found.dark_stacks[name].mean_dn.shape) for one in (plane.dsnu, plane.prnu)
    )
    tolerances = [max(NONUNIFORMITY_TOLERANCE, LEAST_SIGMAS * error) for error in (dsnu_error, prnu_error)]
    dsnu_reason, prnu_reason = few or small or reason_read_noise_is_unmeasurable(sensor), few or weak
    return [
        ToleranceCheck(
            "DSNU",
            name,
            plane.dsnu.total,
            dsnu_dn / gain_dn_per_e,
            tolerances[0],
            dsnu_error,
            "e-",
            reason_unchecked=dsnu_reason,
        ),
        ToleranceCheck("PRNU", name, plane.prnu.total, prnu, tolerances[1], prnu_error, "", reason_unchecked=prnu_reason),
    ]


def _nonuniformity_error(pattern: Nonuniformity, shape: tuple[int, int]) -> float:
    """Relative standard error of a total nonuniformity: the body is one random draw, and it has few rows and columns."""
    if pattern.total == 0:
        return 0.0
    rows, columns = shape
    drawn = ((rows, pattern.row), (columns, pattern.column), (rows * columns, pattern.pixel))
    parts = [math.sqrt(2.0 / (count - 1)) * sd**2 for count, sd in drawn]
    return math.hypot(*parts, 2.0 * pattern.pixel * pattern.error) / (2.0 * pattern.total**2)


def _check_dark_current(name: str, found: EmvaCamera, bench: EmvaBench) -> list[ToleranceCheck]:
    """Check the dark current found from the mean and from the variance of dark frames."""
    if name not in found.dark_current_e_per_s:
        return []
    moments = [bench.dark(time).sensor.moments(0.0) for time in bench.dark_times_s()]
    gain, span = expected_gain(bench.camera, bench.iso, bench.white.sensor), bench.dark_times_s()[-1] - bench.dark_times_s()[0]
    by_mean = (moments[-1].mean - moments[0].mean) / gain / span
    by_variance = (moments[-1].variance - moments[0].variance) / gain**2 / span
    checks = []
    for kind, interval, expected in zip(
        ("mean", "variance"), found.dark_current_e_per_s[name], (by_mean, by_variance), strict=True
    ):
        error = (interval.high - interval.low) / 6.36 / expected  # Student's t of three degrees of freedom: +- 3.18
        tolerance = max(DARK_CURRENT_TOLERANCE, LEAST_SIGMAS * error)
        checks.append(ToleranceCheck(f"dark current by {kind}", name, interval.value, expected, tolerance, error, "e-/s"))
    return checks
