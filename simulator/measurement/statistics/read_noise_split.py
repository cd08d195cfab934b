"""Read noise over ISO: one source before the analog gain, one after it, and where the conversion gain switches.

sigma_DN^2 = (K sigma_pre)^2 + sigma_post^2: in codes, the first grows with the gain K and the second is constant.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from simulator.measurement.statistics.interval import Interval, normal_interval, root

MODEL_ERROR = (
    0.03  # relative, of sigma: least error of a point in the fit, since real amplifiers deviate from the model by as much
)
LEAST_SIGMA_DN = 0.05  # replaces a read noise of 0, whose relative error would be infinite
DROP = 0.85  # sigma_e falls to this share or less from one ISO to the next where the conversion gain switches
STEEPER = 0.25  # change of the slope of log sigma_e over log ISO; exceeds the effect of errors of 3 % on a step of one stop


@dataclass(frozen=True)
class TwoSource:
    """Two-source model of the read noise, fitted to a range of ISO settings.

    isos: settings fitted. before_e: sigma_pre [e-]. after_dn: sigma_post [DN]. worst: largest relative deviation of sigma_DN.
    """

    isos: tuple[int, ...]
    before_e: Interval
    after_dn: Interval
    worst: float

    def sigma_dn(self, gain_dn_per_e: float) -> float:
        """Read noise at a gain K [DN/e-]."""
        return math.hypot(gain_dn_per_e * self.before_e.value, self.after_dn.value)


def fit_two_sources(isos: list[int], gains_dn_per_e: list[float], sigmas_dn: list[Interval]) -> TwoSource:
    """Fit both sources to the read noise at two or more ISO settings, neither below 0.

    Least squares of the relative error, each point weighted by its interval, but by MODEL_ERROR at least. One ISO alone
    gives the total only, which is assigned to the source before the gain.
    """
    gain, sigma = np.array(gains_dn_per_e), np.maximum([part.value for part in sigmas_dn], LEAST_SIGMA_DN)
    relative = np.array([part.standard_error for part in sigmas_dn]) / sigma
    weight = 1.0 / (2.0 * np.hypot(relative, MODEL_ERROR) * sigma**2)
    design = np.stack([gain**2, np.ones_like(gain)], axis=1) if gain.size > 1 else gain[:, np.newaxis] ** 2
    found = optimize.nnls(design * weight[:, np.newaxis], sigma**2 * weight)[0]
    errors = np.sqrt(np.diag(np.linalg.inv((design * weight[:, np.newaxis]).T @ (design * weight[:, np.newaxis]))))
    roots = [_root(value, error) for value, error in zip(found, errors, strict=True)] + [Interval(0.0, 0.0, 0.0)]
    fitted = np.sqrt(design @ found)
    return TwoSource(tuple(isos), roots[0], roots[1], float(np.abs(fitted / sigma - 1.0).max()))


def find_conversion_gain_switch(isos: list[int], sigmas_e: list[float]) -> int | None:
    """Return the first ISO after a switch of the conversion gain, or None where the read noise shows none.

    In the two-source model the slope of log sigma_e over log ISO rises from -1 to 0. A step whose slope is lower than that
    of the step before it by STEEPER, and which reduces sigma_e by the factor DROP or more, is a switch.
    isos: ascending. sigmas_e: read noise [e-].
    """
    if len(isos) < 2 or min(sigmas_e) <= 0:
        return None
    ratio = np.array(sigmas_e[1:]) / np.array(sigmas_e[:-1])
    slopes = np.log2(ratio) / np.log2(np.array(isos[1:]) / np.array(isos[:-1]))
    steeper = np.diff(slopes, prepend=-1.0)
    steepest = int(np.argmin(np.where(ratio <= DROP, steeper, 0.0)))
    return isos[steepest + 1] if ratio[steepest] <= DROP and steeper[steepest] < -STEEPER else None


def _root(value: float, error: float) -> Interval:
    return root(normal_interval(value, error))
