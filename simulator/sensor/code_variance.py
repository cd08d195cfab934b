"""Temporal variance of the codes of each photosite, propagated through the moments of the stages.

The stages' moments follow EMVA 1288 R4.0, eq. 9, and the models of the single stages, without the body's fixed pattern.
Clipping by the full well and the ADC reduces the variance to that of a censored normal distribution.
"""

import math
from collections.abc import Sequence

import numpy as np

from simulator.sensor.stages.stage import Limits, Moments, SignalStep

_NODES = 2**14  # electron counts at which the variance is computed; it is interpolated linearly between them
_AT_ONCE = 2**14  # pixels per step, few enough for the processor's cache
_UNLIMITED: Limits = (-math.inf, math.inf)
_REACH = 8.0  # standard deviations from a clipping limit beyond which clipping has no effect, or leaves no variance


def code_variance(steps: Sequence[SignalStep], mean_electrons: np.ndarray, count: int = 1) -> np.ndarray:
    """Return the variance of each code (height, width) float32 [DN^2] by temporal noise and rounding.

    steps: effect on mean and variance of everything from the photoelectrons to the code, in physical order; the last that
        clips sets the range of the codes.
    mean_electrons: (height, width) float32, mean photoelectrons of each pixel [e-], the sum over `count` photosites.
    The steps are evaluated at 16384 electron counts and interpolated linearly, which is exact for shot noise. The counts belong
    to the sensor, not to the frame, so that a crop has the bits of the whole frame. They are evenly spaced in the square root,
    as shot noise is.
    """
    top_e = count * clipping_electrons(steps)
    electrons = np.linspace(0.0, math.sqrt(top_e), _NODES) ** 2
    nodes = _variance(steps, electrons / count).astype(np.float32)
    slopes = np.append(np.diff(nodes) / np.diff(electrons), 0.0).astype(np.float32)
    starts = electrons.astype(np.float32)
    result = np.empty(mean_electrons.shape, np.float32)
    scale, top, last = np.float32((_NODES - 1) / math.sqrt(top_e)), np.float32(top_e), np.float32(_NODES - 1)
    rows = max(1, _AT_ONCE // mean_electrons.shape[1])
    for first in range(0, len(result), rows):
        part = slice(first, first + rows)
        place = np.minimum(mean_electrons[part], top)
        index = np.minimum(scale * np.sqrt(place), last).astype(np.intp)
        place -= starts.take(index)  # beyond the node at which the interval starts
        place *= slopes.take(index)
        np.add(nodes.take(index), place, out=result[part])
    return result


def clipping_electrons(steps: Sequence[SignalStep]) -> float:
    """Return photoelectrons per photosite above which every code is the white level."""
    dark, one, limits = Moments(0.0, 0.0), Moments(1.0, 0.0), _UNLIMITED
    for step in steps:
        dark, one, limits = step.moments(dark), step.moments(one), step.clip_limits(limits) or limits
    gain = max(one.mean - dark.mean, 1e-12)
    full_e = 2.0 * (limits[1] + 1.0) / gain  # twice, as a margin for nonlinearity
    sigma_e = math.sqrt(max(dark.variance, 0.0)) / gain + math.sqrt(full_e)
    return full_e + _REACH * sigma_e


def _variance(steps: Sequence[SignalStep], electrons: np.ndarray) -> np.ndarray:
    """Return the variance of the code [DN^2] for mean photoelectrons per photosite (n,) float64."""
    return clipped_moments(steps, electrons).variance


def clipped_moments(steps: Sequence[SignalStep], electrons: np.ndarray) -> Moments:
    """Return the moments after these steps for mean photoelectrons per photosite (n,) float64, clipped as the sensor clips."""
    return pass_on(steps, Moments(electrons, *(np.zeros_like(electrons) for _ in range(3))))


def map_moments(steps: Sequence[SignalStep], signal: Moments) -> Moments:
    """Return mean and variance after these steps, clipped as the sensor clips, (height, width) float32 each.

    signal: before the steps, (height, width) float32; its fixed and shared variance may be one number for all.
    """
    shape = signal.mean.shape
    mean, variance = (np.empty(shape, np.float32) for _ in range(2))
    rows = max(1, _AT_ONCE // shape[1])
    for first in range(0, shape[0], rows):
        part = slice(first, first + rows)
        before = (signal.mean, signal.variance, signal.fixed_variance, signal.shared_variance)
        after = pass_on(steps, Moments(*(one[part].astype(np.float64) if np.ndim(one) else one for one in before)))
        mean[part], variance[part] = after.mean, after.variance
    return Moments(mean, variance)


def pass_on(steps: Sequence[SignalStep], signal: Moments) -> Moments:
    """Return the moments after these steps, clipped as the sensor clips.

    signal: before them, mean and variance float64 arrays of one shape; fixed and shared variance likewise, or one number.
    """
    limits = _UNLIMITED
    for step in steps:
        signal = step.unclipped(signal)
        clipped = step.clip_limits(limits)
        if clipped is not None:
            limits = clipped
            signal = clip_moments(signal, *limits)
    return signal


def clip_moments(signal: Moments, low: float, high: float) -> Moments:
    """Return the moments of a normal distribution clipped to limits; those farther than _REACH inside are unchanged.

    A mean beyond a limit becomes the limit however far beyond it lies.
    """
    sigma = np.sqrt(np.maximum(signal.variance, 1e-30))
    a, b = (low - signal.mean) / sigma, (high - signal.mean) / sigma
    near = (a > -_REACH) | (b < _REACH)
    mean, share = signal.mean.copy(), np.ones_like(sigma)
    shift, share[near] = _censored_moments(np.clip(a[near], -40.0, 40.0), np.clip(b[near], -40.0, 40.0))
    mean[near] = np.clip(mean[near] + sigma[near] * shift, low, high)
    return Moments(mean, share * signal.variance, signal.fixed_variance, share * signal.shared_variance)


def _censored_moments(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance of N(0, 1) censored at a and b (Greene, Econometric Analysis, theorem 19.3)."""
    from scipy.special import ndtr

    below, above = ndtr(a), ndtr(-b)
    between = np.maximum(1.0 - below - above, 0.0)
    density_a, density_b = (np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi) for z in (a, b))
    first = a * below + density_a - density_b + b * above
    second = a**2 * below + between + a * density_a - b * density_b + b**2 * above
    return first, np.maximum(second - first**2, 0.0)
