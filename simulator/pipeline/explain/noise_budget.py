"""Noise budget of a code: the share of each stage in the variance, at one signal or over the ISO range."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from simulator.exposure.settings import Exposure
from simulator.sensor.sensor_plan import SensorPlan
from simulator.sensor.stages.stage import Moments, SignalStep


@dataclass(frozen=True)
class NoiseBudget:
    """Moments of one photosite's code, and the share of each stage in them.

    iso, time_s: of the exposure. mean_electrons: photoelectrons expected [e-]. signal_dn: mean code above that of the dark.
    sigma_dn: temporal noise. fixed_sigma_dn: of the body's fixed pattern. gain_dn_per_e: slope of the mean code.
    dark_sigma_dn: temporal noise without light. full_scale_e: electrons that reach the white level.
    shares: part of the temporal variance by stage, in physical order; they add up to 1. fixed_shares: of the fixed one.
    """

    iso: int
    time_s: float
    mean_electrons: float
    signal_dn: float
    sigma_dn: float
    fixed_sigma_dn: float
    gain_dn_per_e: float
    dark_sigma_dn: float
    full_scale_e: float
    shares: dict[str, float]
    fixed_shares: dict[str, float]

    @property
    def sigma_e(self) -> float:
        """Temporal noise in electrons at the input [e-]."""
        return self.sigma_dn / self.gain_dn_per_e

    @property
    def snr(self) -> float:
        """Signal over temporal noise."""
        return self.signal_dn / self.sigma_dn

    @property
    def dynamic_range_stops(self) -> float:
        """log2 of full scale over the noise of the dark; minus infinity where dark current fills the range."""
        return -math.inf if self.full_scale_e == 0.0 else math.log2(self.full_scale_e * self.gain_dn_per_e / self.dark_sigma_dn)

    @property
    def is_clipped(self) -> bool:
        """Whether the patch reaches the white level, where the budget does not hold."""
        return self.mean_electrons >= self.full_scale_e


def contributions(steps: Iterable[SignalStep], mean_electrons: float) -> tuple[Moments, dict[str, float], dict[str, float]]:
    """Return the moments after all steps, and each step's part of the variance and of the fixed-pattern variance there.

    A step's own variance is what it makes of a signal without noise; it scales the parts of the steps before it. So the parts
    add up to the variance, and each is the variance of all steps less the variance without that step.
    """
    signal = Moments(mean_electrons, 0.0)
    parts: dict[str, Moments] = {}
    temporal: dict[str, float] = {}
    fixed: dict[str, float] = {}
    for step in steps:
        own = step.moments(Moments(signal.mean, 0.0))
        without = own.widened(-1.0, 0.0)
        for name, part in parts.items():
            scaled = step.moments(replace(part, mean=signal.mean))
            parts[name] = without.plus(0.0, scaled.variance, scaled.fixed_variance, scaled.shared_variance)
        known = parts.get(step.name, Moments(0.0, 0.0))  # binning is two steps
        parts[step.name] = known.plus(0.0, own.variance, own.fixed_variance, own.shared_variance)
        temporal |= {step.name: 0.0} if own.variance > 0 else {}
        fixed |= {step.name: 0.0} if own.fixed_variance > 0 else {}
        signal = step.moments(signal)
    temporal = {name: parts[name].variance for name in temporal}
    fixed = {name: parts[name].fixed_variance for name in fixed}
    return signal, temporal, fixed


def noise_budget(sensor: SensorPlan, mean_electrons: float, iso: int, time_s: float) -> NoiseBudget:
    """Return the budget of a photosite with these mean photoelectrons [e-], on a sensor planned for this ISO and time [s]."""
    signal, temporal, fixed = contributions(*sensor.steps_at(mean_electrons))
    dark = sensor.moments(0.0)
    return NoiseBudget(
        iso=iso,
        time_s=time_s,
        mean_electrons=mean_electrons,
        signal_dn=signal.mean - dark.mean,
        sigma_dn=math.sqrt(signal.variance),
        fixed_sigma_dn=math.sqrt(signal.fixed_variance),
        gain_dn_per_e=sensor.gain_dn_per_e(),
        dark_sigma_dn=math.sqrt(dark.variance),
        full_scale_e=sensor.electrons_at_white(),
        shares={name: part / signal.variance for name, part in temporal.items()},
        fixed_shares={name: part / signal.fixed_variance for name, part in fixed.items() if part > 0},
    )


def iso_budgets(
    sensor: SensorPlan, exposure: Exposure, mean_electrons: float, isos: Iterable[int], keep: Literal["exposure", "brightness"]
) -> list[NoiseBudget]:
    """Return the budgets of one patch over the ISO range.

    sensor, exposure: of the shot as it is. mean_electrons: of the patch there [e-].
    keep: "exposure" leaves the shutter, so all ISOs count the same electrons; "brightness" shortens it as the ISO grows, so
    that the picture stays as bright and the light gets less.
    Raises PhotositeError for an ISO that the camera does not have.
    """
    budgets = []
    for iso in isos:
        share = exposure.iso / iso if keep == "brightness" else 1.0
        time_s = exposure.time_s * share
        budgets.append(noise_budget(sensor.at(iso, time_s), mean_electrons * share, iso, time_s))
    return budgets
