"""Temporal variance of the combined signal of an HDR read-out: a mixture of two readings near each switch point.

Of readings A and B with means a, b and standard deviations s_A, s_B, A is taken below the switch point t. Readings of one
charge share its shot noise, with the covariance c; those of different exposures or photodiodes are independent. With z = (t -
a) / s_A and B's regression b + (c / s_A^2) (A - a), mean and mean square of what is taken are those of a normal A truncated
above t, and of B where A lies above t: E[A - a; A < t] = -s_A phi(z), E[(A - a)^2; A < t] = s_A^2 (Phi(z) - z phi(z)).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from simulator.device import Buffer, Device
from simulator.sensor.code_variance import clip_moments, clipped_moments, clipping_electrons, pass_on
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.readout import read_charge_moments
from simulator.sensor.sensor_plan import read_out_of
from simulator.sensor.stages.stage import Moments, SignalStep

_NODES = 2**13  # electron counts at which each reading's moments are computed; they are interpolated linearly between them
_AT_ONCE = 2**16  # pixels


def combined_variance(sensor: HdrSensorPlan, mean_electrons: Sequence[np.ndarray], count: int = 1) -> np.ndarray:
    """Return the variance of each combined code (height, width) float32 [DN^2] by temporal noise, rounding and companding.

    mean_electrons: of each exposure, (height, width) float32, mean photoelectrons [e-], the sum over `count` photosites.
    The rounding of companded codes is taken as noise of its own, right where other noise is at least half of their distance.
    """
    tables = [_node_moments(sensor, place, count) for place in range(len(sensor.readings))]

    def moments(place: int, part: slice) -> tuple[np.ndarray, ...]:
        nodes, *values = tables[place]
        light = mean_electrons[sensor.readings[place].exposure][part].astype(np.float64)
        own = np.sqrt(sensor.spec.light_share(place) * light)
        return tuple(np.interp(own, nodes, one) for one in values)

    return _combine(sensor, mean_electrons[0].shape, moments)


def mixed_combined_variance(device: Device, sensor: HdrSensorPlan, lights: Sequence[Buffer]) -> np.ndarray:
    """Return the variance as `combined_variance` does where electrical crosstalk mixes the charges of unequal neighbours.

    lights: mosaic of electron radiance of each exposure, (height, width) float32.
    """
    owners = {one.charge: one for one in reversed(sensor.readings)}
    charges = {
        owner: read_charge_moments(device, replace(one.sensor, readout=sensor.readout), lights[one.exposure])
        for owner, one in owners.items()
    }
    steps = [read_out_of(sensor.reading_steps(place)) for place in range(len(sensor.readings))]

    def moments(place: int, part: slice) -> tuple[np.ndarray, ...]:
        charge = charges[sensor.readings[place].charge]
        mean, variance = (one[part].astype(np.float64) for one in (charge.mean, charge.variance))
        return _reading_moments(sensor, place, steps[place], Moments(mean, variance))

    read = sensor.readout.read
    return _combine(sensor, (read.height, read.width), moments)[sensor.readout.kept]


def _combine(
    sensor: HdrSensorPlan, shape: tuple[int, ...], moments: Callable[[int, slice], tuple[np.ndarray, ...]]
) -> np.ndarray:
    """Return the variance of the combined signal (height, width) float32 [DN^2].

    moments: mean, variance and the charge's part of the variance of a reading in a slice of rows, in the combined signal.
    """
    result = np.empty(shape, np.float32)
    rows = max(1, _AT_ONCE // shape[1])
    for first in range(0, shape[0], rows):
        part = slice(first, first + rows)
        found: tuple[np.ndarray, np.ndarray] | None = None
        for place in reversed(range(len(sensor.readings))):
            reading, here = sensor.readings[place], moments(place, part)
            if found is None:
                found = here[0], here[1]
                continue
            shared = sensor.readings[place + 1].charge == reading.charge
            switch_dn = float(sensor.combined_dn(reading, reading.switch_dn - 0.5))
            found = _mix(here[0], here[1], found, here[2] if shared else np.zeros_like(here[2]), switch_dn)
        assert found is not None
        result[part] = found[1]
    return result


def _mix(
    mean: np.ndarray, variance: np.ndarray, after: tuple[np.ndarray, np.ndarray], covariance: np.ndarray, switch_dn: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance of a reading below the switch point, and of the readings after it elsewhere [DN, DN^2]."""
    from scipy.special import ndtr

    sigma = np.sqrt(np.maximum(variance, 1e-12))
    z = np.clip((switch_dn - mean) / sigma, -40.0, 40.0)
    below, density = ndtr(z), np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
    slope = covariance / sigma**2
    apart, later = mean - after[0], after[1]
    first = apart * below - sigma * density + slope * sigma * density
    own = apart**2 * below - 2.0 * apart * sigma * density + variance * (below - z * density)
    other = later * (1.0 - below) + slope**2 * variance * z * density
    return after[0] + first, np.maximum(own + other - first**2, 0.0)


def _node_moments(sensor: HdrSensorPlan, place: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return square roots of electron counts, and there mean, variance and the charge's part of the variance of a reading.

    All in the combined signal [DN, DN^2]; the electron counts are those of a pixel, the sum over `count` photosites.
    """
    steps = sensor.reading_steps(place)
    top_e = count * clipping_electrons(steps[:-1])  # the last one combines
    roots = np.linspace(0.0, math.sqrt(top_e), _NODES)
    electrons = roots**2 / count
    readout = read_out_of(steps)
    charge = clipped_moments(steps[: -len(readout)], electrons)
    return roots, *_reading_moments(sensor, place, readout, charge)


def _reading_moments(
    sensor: HdrSensorPlan, place: int, readout: Sequence[SignalStep], charge: Moments
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean, variance and the charge's part of the variance of a reading in the combined signal [DN, DN^2].

    readout: the steps from the charge on, the last one combines. charge: its moments, arrays float64 [e-, e-^2].
    Where a full well sets the white level, it has clipped the charge; the combined signal's clip at white then acts on the
    noise of the read-out alone.
    """
    signal = pass_on(readout, charge)
    gain = sensor.readings[place].factor * _slope(readout[:-1])
    of_charge = gain**2 * charge.variance
    own = np.maximum(signal.variance - of_charge, 0.0)
    clipped = clip_moments(Moments(signal.mean, own), 0.0, float(sensor.white_level_dn()))
    signal = Moments(clipped.mean, signal.variance - (own - clipped.variance))
    return signal.mean, signal.variance + _companding_variance(sensor, place, signal), of_charge


def _slope(steps: Sequence) -> float:
    """Return the slope of the code over the charge [DN/e-]."""
    dark, one = Moments(0.0, 0.0), Moments(1.0, 0.0)
    for step in steps:
        dark, one = step.unclipped(dark), step.unclipped(one)
    return float(one.mean - dark.mean)


def _companding_variance(sensor: HdrSensorPlan, place: int, signal: Moments) -> np.ndarray:
    """Return the variance of the error of rounding and companding among the codes that a reading's noise reaches [DN^2]."""
    reading = sensor.readings[place]
    table = sensor.table(reading).astype(np.float64)
    error = table - np.clip(sensor.combined_dn(reading, np.arange(len(table))), 0.0, sensor.white_level_dn())
    sums, squares = (np.concatenate([[0.0], np.cumsum(error**power)]) for power in (1, 2))
    centre = (signal.mean - sensor.black_level_dn) / reading.factor + reading.black_dn
    half = np.maximum(np.sqrt(3.0 * np.maximum(signal.variance, 0.0)) / reading.factor, 2.0)
    # An even window of the same variance; at least two codes to each side.
    first = np.clip(np.floor(centre - half), 0, len(table) - 1).astype(np.intp)
    last = np.clip(np.ceil(centre + half) + 1, first + 1, len(table)).astype(np.intp)
    mean = (sums[last] - sums[first]) / (last - first)
    return np.maximum((squares[last] - squares[first]) / (last - first) - mean**2, 0.0)
