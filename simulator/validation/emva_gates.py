"""What the EMVA 1288 numbers measured from files must agree with, and how well."""

import math

import numpy as np
from scipy import stats

from simulator.planner import Plan
from simulator.spectra import efficiency_on
from simulator.validation.emva import COLOR_OF, EmvaCamera
from simulator.validation.emva_frames import HALF, SHARES, EmvaBench
from simulator.validation.flat_frames import FlatBench
from simulator.validation.gate import LEAST_SIGMAS, Gate
from simulator.validation.noise_gates import (
    GAIN_TOLERANCE,
    LEAST_READ_NOISE_DN,
    READ_NOISE_TOLERANCE,
    dark_variance,
    expected_gain,
    no_read_noise_gate,
    read_noise_dn,
)

EFFICIENCY_TOLERANCE = 0.005
SATURATION_TOLERANCE = 0.02  # the steps of light about it are 1 % apart
SNR_TOLERANCE = 0.01
RANGE_TOLERANCE = 0.03
LINEARITY_TOLERANCE = 0.05  # %
PATTERN_TOLERANCE = 0.03
LEAST_PRNU = 0.005
DARK_CURRENT_TOLERANCE = 0.02


def emva_gates(found: EmvaCamera, bench: EmvaBench) -> list[Gate]:
    """Compare every plane with the camera file."""
    gates = []
    for name in found.planes:
        one = bench.colors[COLOR_OF[name]]
        gates += _temporal(name, found, bench, one) + _patterns(name, found, bench, one.planned)
        gates += _dark_current(name, found, bench)
    return gates


def _temporal(name: str, found: EmvaCamera, bench: EmvaBench, one: FlatBench) -> list[Gate]:
    """K, quantum efficiency, dark noise, saturation, SNR, dynamic range, linearity."""
    plane, planned, camera = found.planes[name], one.planned, bench.camera
    gain_dn_per_e = expected_gain(camera, bench.iso, planned)
    curves = efficiency_on([found.wavelengths_nm[name]], camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    efficiency = float(curves[0, list(bench.colors).index(COLOR_OF[name])]) * camera.fill_factor
    dark_dn2, saturation_e = dark_variance(planned), _saturation_e(one)
    sigma_d = math.sqrt(max(dark_dn2 - 1.0 / 12.0, 0.0)) / gain_dn_per_e
    gain_error = plane.gain.standard_error / plane.gain.value
    read_error = plane.read_noise.standard_error / sigma_d if sigma_d > 0 else 0.0
    dynamic_range = saturation_e / (math.sqrt(dark_dn2) / gain_dn_per_e + 0.5)
    reason = no_read_noise_gate(planned, read_noise_dn(planned))
    read_tolerance = max(READ_NOISE_TOLERANCE, LEAST_SIGMAS * read_error)
    line, line_error = plane.linearity, 100.0 * plane.linearity_error
    line_tolerance = max(LINEARITY_TOLERANCE, LEAST_SIGMAS * line_error)
    bent = "" if planned.stage("nonlinearity") is None else "the camera is not linear"
    return [
        Gate("K", name, plane.gain.value, gain_dn_per_e, GAIN_TOLERANCE, gain_error, "DN/e-"),
        Gate(
            "quantum efficiency",
            name,
            plane.quantum_efficiency.value,
            efficiency,
            EFFICIENCY_TOLERANCE,
            gain_error,
            "e-/photon",
        ),
        Gate("sigma_d", name, plane.read_noise.value, sigma_d, read_tolerance, read_error, "e-", ungated=reason),
        Gate("saturation", name, plane.saturation_e, saturation_e, SATURATION_TOLERANCE, gain_error, "e-"),
        Gate("SNR_max", name, plane.snr_max, math.sqrt(saturation_e), SNR_TOLERANCE, gain_error / 2.0),
        Gate("dynamic range", name, plane.dynamic_range, dynamic_range, RANGE_TOLERANCE, read_error, ungated=reason),
        Gate("LE_min", name, 100.0 * line.least, 0.0, line_tolerance, line_error, "%", relative=False, ungated=bent),
        Gate("LE_max", name, 100.0 * line.greatest, 0.0, line_tolerance, line_error, "%", relative=False, ungated=bent),
    ]


def _saturation_e(bench: FlatBench) -> float:
    """Electrons of the step with the largest variance, by the model: normal noise cut at the white level."""
    shares, gain = np.array(SHARES), bench.planned.moments(1.0).mean - bench.planned.moments(0.0).mean
    moments = [bench.planned.moments(share * bench.saturation_e) for share in SHARES]
    white, dark = bench.planned.white_level_dn(), bench.planned.moments(0.0)
    # A full well ends the stages' own variance; the noise before it goes on as below it.
    mean = dark.mean + gain * shares * bench.saturation_e
    below_well = next(one for one in reversed(moments) if one.mean < white)
    rise = (below_well.variance - dark.variance) / (below_well.mean - dark.mean)
    spread = np.sqrt(dark.variance + rise * (mean - dark.mean))
    z = (white - mean) / spread
    under, density = stats.norm.cdf(z), stats.norm.pdf(z)
    first = mean * under - spread * density + white * (1.0 - under)
    second = (mean**2 + spread**2) * under - spread * (white + mean) * density + white**2 * (1.0 - under)
    return float(shares[np.argmax(second - first**2)]) * bench.saturation_e


def _patterns(name: str, found: EmvaCamera, bench: EmvaBench, planned: Plan) -> list[Gate]:
    """DSNU and PRNU against the fixed variances of the stages."""
    plane, gain_dn_per_e = found.planes[name], expected_gain(bench.camera, bench.iso, planned)
    dark, half = planned.moments(0.0), planned.moments(HALF * bench.colors[COLOR_OF[name]].saturation_e)
    dsnu_dn = math.sqrt(getattr(dark, "fixed_variance", 0.0))
    prnu = math.sqrt(max(getattr(half, "fixed_variance", 0.0) - getattr(dark, "fixed_variance", 0.0), 0.0)) / (
        half.mean - dark.mean
    )
    defects = [stem for stem in ("hot_pixels", "dead_pixels") if planned.stage(stem) is not None]
    few = "defect photosites are part of it, so few that chance decides" if defects else ""
    small = f"below {LEAST_READ_NOISE_DN} DN, where rounding hides it" if dsnu_dn < LEAST_READ_NOISE_DN else ""
    weak = f"below {100 * LEAST_PRNU} %" if prnu < LEAST_PRNU else ""
    dsnu_error, prnu_error = (_pattern_error(one, found.dark_stacks[name].mean_dn.shape) for one in (plane.dsnu, plane.prnu))
    dsnu_reason = few or small or no_read_noise_gate(planned, read_noise_dn(planned))
    tolerances = [max(PATTERN_TOLERANCE, LEAST_SIGMAS * error) for error in (dsnu_error, prnu_error)]
    return [
        Gate("DSNU", name, plane.dsnu.total, dsnu_dn / gain_dn_per_e, tolerances[0], dsnu_error, "e-", ungated=dsnu_reason),
        Gate("PRNU", name, plane.prnu.total, prnu, tolerances[1], prnu_error, "", ungated=few or weak),
    ]


def _pattern_error(pattern, shape: tuple[int, int]) -> float:
    """Relative standard error of a pattern's total, since this body is one draw: few rows and columns scatter more."""
    if pattern.total == 0:
        return 0.0
    rows, columns = shape
    parts = (
        2.0 * pattern.pixel * pattern.error,
        *(math.sqrt(2.0 / (n - 1)) * s**2 for n, s in ((rows, pattern.row), (columns, pattern.column))),
        math.sqrt(2.0 / (rows * columns)) * pattern.pixel**2,
    )
    return math.hypot(*parts) / (2.0 * pattern.total**2)


def _dark_current(name: str, found: EmvaCamera, bench: EmvaBench) -> list[Gate]:
    """Dark current by mean and by variance."""
    if name not in found.dark_current_e_per_s:
        return []
    moments = [bench.dark(time).planned.moments(0.0) for time in bench.dark_times_s()]
    gain, span = expected_gain(bench.camera, bench.iso, bench.white.planned), bench.dark_times_s()[-1] - bench.dark_times_s()[0]
    by_mean = (moments[-1].mean - moments[0].mean) / gain / span
    by_variance = (moments[-1].variance - moments[0].variance) / gain**2 / span
    gates = []
    for kind, interval, expected in zip(
        ("mean", "variance"), found.dark_current_e_per_s[name], (by_mean, by_variance), strict=True
    ):
        error = (interval.high - interval.low) / 6.36 / expected  # Student's t of three degrees of freedom: +- 3.18
        tolerance = max(DARK_CURRENT_TOLERANCE, LEAST_SIGMAS * error)
        gates.append(Gate(f"dark current by {kind}", name, interval.value, expected, tolerance, error, "e-/s"))
    return gates
