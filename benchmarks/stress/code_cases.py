"""Cases of the kernels that combine codes: binned, of another pattern, and of several readings."""

from dataclasses import replace

import numpy as np
from helpers.hdr_bench import DUAL_GAIN, HIGH, LOW, TWO_EXPOSURES, combined_codes, hdr_plan
from helpers.neighbors import binned

from simulator.device import Device
from simulator.pipeline.planner import Plan
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.remosaic import Remosaic, remosaic_weights
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.readout import read_out
from simulator.sensor.seeds import Seeds

from .inputs import COLUMNS, ROWS, SHAPE, number, picture
from .neighbor_cases import GROUPS, plan_of, remosaic_sum
from .search import Outcome, StressCase
from .space import Choice, Inputs, Picture

LIGHT = Picture(SHAPE, 1e-3, 1e12)
SEEDS = Seeds(1, 2)
SILENT = {iso: replace(setting, read_noise_dn=0.0) for iso, setting in ((100, LOW), (1600, HIGH))}


def codes_of(device: Device, planned: Plan, light: np.ndarray) -> np.ndarray:
    """Return the codes of a camera without noise."""
    return read_out(device, planned.sensor, device.upload(light), SEEDS).astype(np.float64)


def beyond_rounding(found: np.ndarray, exact: np.ndarray, rounding_dn: np.ndarray | float = 0.5) -> Outcome:
    """Return what is left of codes [DN] beside what their rounding explains, in the noise of a rounded code."""
    miss = found - exact
    left = np.sign(miss) * np.maximum(np.abs(miss) - rounding_dn, 0.0)
    return Outcome(exact + left, exact, exact + rounding_dn, 12.0**-0.5)


def run_bin_codes(device: Device, inputs: Inputs) -> Outcome:
    factor, cfa = int(number(inputs, "factor")), str(inputs["cfa"])
    single = codes_of(device, plan_of(cfa=cfa), picture(inputs))
    averaged = codes_of(device, plan_of(cfa=cfa, binning=Binning(factor, "average")), picture(inputs))
    exact = binned(single, factor, 1 if cfa == "MONO" else 2) / factor**2
    return beyond_rounding(averaged, exact)


def run_remosaic_codes(device: Device, inputs: Inputs) -> Outcome:
    group = int(number(inputs, "group"))
    single = codes_of(device, plan_of(cfa=GROUPS[group]), picture(inputs))
    planned = plan_of(cfa=GROUPS[group], remosaic=Remosaic())
    weights = remosaic_weights(Cfa.named(GROUPS[group])).astype(np.float64)
    exact = remosaic_sum(single, weights)
    return beyond_rounding(codes_of(device, planned, picture(inputs)), np.clip(exact, 0.0, planned.sensor.adc_range[1]))


def run_combine_codes(device: Device, inputs: Inputs) -> Outcome:
    """Near the code at which a reading ends, either of two readings is right."""
    readout = DUAL_GAIN if inputs["readout"] == "gains" else TWO_EXPOSURES
    sensor = hdr_plan(readout, COLUMNS, ROWS, stages={}, iso_table=SILENT)
    assert isinstance(sensor, HdrSensorPlan)
    electrons = picture(inputs).astype(np.float64)
    found, white = combined_codes(device, sensor, picture(inputs)).astype(np.float64), 2.0**12 - 1.0
    nearest, exact, rounding = np.full(SHAPE, np.inf), np.zeros(SHAPE), np.full(SHAPE, 0.5)
    for place, reading in reversed(list(enumerate(sensor.readings))):
        gain = LOW.gain_dn_per_e if readout is DUAL_GAIN and place else HIGH.gain_dn_per_e
        shorter = 0.0625 if readout is TWO_EXPOSURES and place else 1.0
        level = np.clip(gain * shorter * electrons + 64.0, 0.0, white)
        combined = np.clip(sensor.black_level_dn + reading.factor * (level - reading.black_dn), 0.0, sensor.white_level_dn())
        may_be = (level < reading.switch_dn + 0.5) | (place == len(sensor.readings) - 1)
        must_be = level < reading.switch_dn - 0.5
        off = np.abs(found - combined) - 0.5 * reading.factor - 0.5
        chosen = may_be & ((off < nearest) | must_be)
        nearest = np.where(chosen, off, nearest)
        exact, rounding = np.where(chosen, combined, exact), np.where(chosen, 0.5 * reading.factor + 0.5, rounding)
    return beyond_rounding(found, exact, rounding)


CASES = (
    StressCase(
        "bin_codes",
        ("bin_codes",),
        {"light": LIGHT, "factor": Choice((2, 3, 4)), "cfa": Choice(("MONO", "RGGB"))},
        run_bin_codes,
        "a sum of codes is exact; a share of one ninth is rounded, and its product",
        most_ulps=2.0,
    ),
    StressCase(
        "remosaic_codes",
        ("remosaic_codes",),
        {"light": LIGHT, "group": Choice((2, 3))},
        run_remosaic_codes,
        "half a DN of rounding; a sum of 49 products, whose weights may be below 0",
        most_ulps=300.0,
    ),
    StressCase(
        "combine_codes",
        ("combine_codes",),
        {"light": Picture(SHAPE, 1e-3, 1e9), "readout": Choice(("gains", "exposures"))},
        run_combine_codes,
        "half a DN of the reading, times its factor, and half a DN of the combined code; codes are rounded gains of float32",
        most_ulps=8.0,
    ),
)
