"""Cases of the chain from the light on a photosite to its code: stages, noise, truth and readings that are combined."""

from dataclasses import replace

import numpy as np
from helpers.hdr_bench import DUAL_GAIN, HIGH, LOW, TWO_EXPOSURES, hdr_plan
from helpers.kernel_bench import Bench
from helpers.stability_cases import Body, Case

from simulator.device import Device
from simulator.sensor.hdr_passes import read_noise_free_combined
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.kernel.kernel_launch import FrameSetting, tile_extremes
from simulator.sensor.kernel.noise_free import code_of_light, mean_electrons
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Stage

from .inputs import ANY, COLUMNS, ROWS, SHAPE, number, picture
from .light_cases import LENS_SPACE, irradiance_of, relative_illumination, vignetting_size
from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real, Whole


def run_tile_range(device: Device, inputs: Inputs) -> Outcome:
    height, light = int(number(inputs, "tile_height")), picture(inputs)
    edges = np.unique([*range(0, ROWS, height), ROWS])
    found = tile_extremes(device, device.upload(light), COLUMNS, edges, height)
    parts = [light[first:last].astype(np.float64) for first, last in zip(edges, edges[1:], strict=False)]
    return Outcome(found, np.stack([[part.min(axis=0) for part in parts], [part.max(axis=0) for part in parts]]))


def stages_of(inputs: Inputs) -> tuple[Stage, ...]:
    """Return the stages of these inputs that change the mean."""
    white = 2.0 ** int(number(inputs, "bits")) - 1.0
    errors = tuple(number(inputs, f"error_{node}") for node in range(4))
    black = number(inputs, "black") * white
    return (
        Integration(number(inputs, "time_s"), number(inputs, "area_um2")),
        STAGES["dark_current"](number(inputs, "dark_e_per_s"), number(inputs, "time_s")),
        STAGES["full_well"](number(inputs, "well_e")),
        STAGES["conversion_gain"](number(inputs, "ratio")),
        STAGES["analog_gain"](number(inputs, "gain")),
        STAGES["nonlinearity"](errors, white - black),
        STAGES["adc"](int(number(inputs, "bits")), black),
    )


def exact_level(inputs: Inputs, electrons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the code before rounding and the size of its terms [DN], float64, of mean electrons in the well."""
    *_, nonlinearity, adc = stages_of(inputs)
    white = 2.0 ** int(number(inputs, "bits")) - 1.0
    black = float(adc.black_level_dn)  # type: ignore[attr-defined]
    well = np.minimum(electrons + number(inputs, "dark_e_per_s") * number(inputs, "time_s"), number(inputs, "well_e"))
    level = number(inputs, "gain") * number(inputs, "ratio") * well
    errors = np.asarray(nonlinearity.errors_dn)  # type: ignore[attr-defined]
    steepest = np.abs(np.diff(errors)).max() * (len(errors) - 1) / (white - black)  # error of the level, through the curve
    size = np.minimum(level, 2.0 * white) * (1.0 + steepest) + np.abs(errors).max() + black
    level = level + np.interp(level, np.linspace(0.0, white - black, len(errors)), errors)
    return np.clip(level + black, 0.0, white), size


STAGE_SPACE: dict[str, Domain] = {
    "time_s": Real(1e-6, 3600.0, log=True),
    "area_um2": Real(0.3, 900.0, log=True),
    "dark_e_per_s": Real(1e-4, 1e5, log=True),
    "well_e": Real(1.0, 1e7, log=True),
    "ratio": Real(1.0, 20.0),
    "gain": Real(1e-3, 1e3, log=True),
    "bits": Whole(8, 16),
    "black": Real(0.0, 0.5),
    **{f"error_{node}": Real(-100.0, 100.0) for node in range(4)},
}
LIGHT = Picture(SHAPE, 1e-30, 1e20)


def run_truth_electrons(device: Device, inputs: Inputs) -> Outcome:
    lens, place = irradiance_of(inputs), (int(number(inputs, "x")), int(number(inputs, "y")))
    setting = FrameSetting((lens, *stages_of(inputs)), x=place[0], y=place[1])
    electrons = device.empty(SHAPE, np.float32)
    mean_electrons(device, device.upload(picture(inputs)), electrons, SHAPE, [setting])
    light = picture(inputs).astype(np.float64) * number(inputs, "time_s") * number(inputs, "area_um2")
    size = light * vignetting_size(lens, *place) * lens.effective_solid_angle_sr
    least = np.finfo(np.float32).tiny * number(inputs, "time_s") * number(inputs, "area_um2")  # of a denormal irradiance
    exact = light * relative_illumination(lens, *place)
    return Outcome(device.download(electrons, SHAPE, np.float32), exact, np.maximum(size, least))


def run_truth_code(device: Device, inputs: Inputs) -> Outcome:
    code = device.empty(SHAPE, np.float32)
    code_of_light(device, device.upload(picture(inputs)), code, SHAPE, [FrameSetting(stages_of(inputs))])
    electrons = picture(inputs).astype(np.float64) * number(inputs, "time_s") * number(inputs, "area_um2")
    exact, size = exact_level(inputs, electrons)
    return Outcome(device.download(code, SHAPE, np.float32), exact, size, sigma_dn(inputs, electrons))


def sigma_dn(inputs: Inputs, electrons: np.ndarray) -> np.ndarray:
    """Return the noise of each photosite [DN]: of its light, its reading and its rounding."""
    kept = np.minimum(electrons, number(inputs, "well_e"))
    gain = number(inputs, "gain") * number(inputs, "ratio")
    return np.sqrt(gain**2 * (kept + 1.0) + 1.0 / 12.0)


def run_sensor(device: Device, inputs: Inputs) -> Outcome:
    """Without noise; a dark current of none, since it is counted."""
    inputs = inputs | {"dark_e_per_s": 0.0}
    chain = [stage for stage in stages_of(inputs) if stage.stem not in ("dark_current", "adc", "analog_gain", "exposure")]
    adc = stages_of(inputs)[-1]
    black = float(adc.black_level_dn)  # type: ignore[attr-defined]
    codes = Bench(device).sensor(
        picture(inputs), *chain, gain=number(inputs, "gain"), bits=int(number(inputs, "bits")), black=black
    )
    electrons = picture(inputs).astype(np.float64)
    exact, size = exact_level(inputs, electrons)
    miss = codes - exact
    beyond = np.sign(miss) * np.maximum(np.abs(miss) - 0.5, 0.0)  # of the rounding to codes
    return Outcome(exact + beyond, exact, size, sigma_dn(inputs, electrons))


def run_sensor_noise(device: Device, inputs: Inputs) -> Outcome:
    """Every noise at once: a code that its mean and noise do not allow counts by its distance from those allowed."""
    bits = int(number(inputs, "bits"))
    black, gain, well = number(inputs, "black") * 2.0 ** (bits - 1), number(inputs, "gain"), number(inputs, "well_e")
    case = Case(1.0, 0.0, number(inputs, "time_s"), 100, gain, bits, black, 1.0, 1.0, well, 1.0, True)
    case = replace(case, before_e=number(inputs, "before_e"), after_dn=number(inputs, "after_dn"))
    case = replace(case, dark_e_per_s=number(inputs, "dark_e_per_s"))
    pair = number(inputs, "share"), number(inputs, "size")
    errors = tuple(number(inputs, f"error_{node}") for node in range(4))
    body = Body(
        0.2 * pair[0],
        pair[0],
        pair,
        pair[1],
        number(inputs, "ratio"),
        number(inputs, "spread"),
        pair,
        min(pair[1], 100.0),
        min(pair[1], 100.0),
        (min(pair[1], 100.0), 2.0 + pair[1]),
        number(inputs, "tukey_lambda"),
        errors,  # type: ignore[arg-type]
        (*errors, 0.0),
        number(inputs, "digital"),
    )
    light, seed = picture(inputs), int(number(inputs, "seed"))
    codes = Bench(device).sensor(light, *body.stages(case), gain=gain, bits=bits, black=black, frame_seed=seed)
    low, high = body.code_range(case, light.astype(np.float64))
    return Outcome(codes, np.clip(codes.astype(np.float64), np.floor(low), np.ceil(high)))


NOISE_SPACE = STAGE_SPACE | {
    "light": Picture(SHAPE, 1e-6, 1e7),
    "before_e": Real(1e-3, 1e3, log=True),
    "after_dn": Real(1e-3, 1e3, log=True),
    "share": Real(0.0, 1.0),
    "size": Real(1e-2, 1e4, log=True),
    "spread": Choice((0.01, 0.2, 1.0)),
    "tukey_lambda": Choice((-0.3, -0.044, 0.0, 0.14, 0.25)),
    "digital": Real(1e-2, 1e3, log=True),
    "seed": Whole(0, 2**31),
}


def run_hdr_readout(device: Device, inputs: Inputs) -> Outcome:
    readout = DUAL_GAIN if inputs["readout"] == "gains" else TWO_EXPOSURES
    sensor = hdr_plan(readout, COLUMNS, ROWS, stages={})
    assert isinstance(sensor, HdrSensorPlan)
    light = picture(inputs)
    found = read_noise_free_combined(device, sensor, [device.upload(light)] * len(sensor.exposures))
    electrons, exact = light.astype(np.float64), np.zeros(SHAPE)
    white = 2.0**12 - 1.0
    for place, reading in reversed(list(enumerate(sensor.readings))):
        gain = LOW.gain_dn_per_e if readout is DUAL_GAIN and place else HIGH.gain_dn_per_e
        shorter = 0.0625 if readout is TWO_EXPOSURES and place else 1.0
        level = np.clip(gain * shorter * electrons + 64.0, 0.0, white)
        exact = np.where(level < reading.switch_dn, sensor.black_level_dn + reading.factor * (level - reading.black_dn), exact)
    sigma = np.sqrt(HIGH.gain_dn_per_e**2 * (np.minimum(electrons, 6e4) + 1.0) + 1.0 / 12.0)
    return Outcome(found, exact, sensor.readings[-1].factor * 64.0 + exact, sigma)


CASES = (
    StressCase(
        "tile_range",
        ("tile_range",),
        {"light": ANY, "tile_height": Choice((2, 5, 16, 24))},
        run_tile_range,
        "numbers are compared",
        most_ulps=0.0,
    ),
    StressCase(
        "truth_electrons",
        ("mean_electrons",),
        {"light": LIGHT, **LENS_SPACE, **STAGE_SPACE},
        run_truth_electrons,
        "of cos^4 and solid angle 24.8 roundings (test_stability.py), of the vignetting 16",
        most_ulps=41.0,
    ),
    StressCase(
        "truth_code",
        ("code_of_light",),
        {"light": LIGHT, **STAGE_SPACE},
        run_truth_code,
        "a chain of ten rounded products and sums, relative to the sum of their sizes",
        most_ulps=10.0,
    ),
    StressCase(
        "sensor",
        ("sensor",),
        {"light": Picture(SHAPE, 1e-30, 3e38), **STAGE_SPACE},
        run_sensor,
        "the chain of truth_code, beyond the half DN of rounding",
        most_ulps=10.0,
    ),
    StressCase(
        "sensor_noise",
        ("sensor",),
        NOISE_SPACE,
        run_sensor_noise,
        "no code lies beyond what 7.1 sigma, 22.3 means of an exponential and 1e-12 of a Poisson number allow",
        most_ulps=0.0,
    ),
    StressCase(
        "hdr_readout",
        ("combine_noise_free", "mean_charge", "code_of_charge"),
        {"light": Picture(SHAPE, 1e-6, 1e9), "readout": Choice(("gains", "exposures"))},
        run_hdr_readout,
        "three rounded products and four sums, times the factor of the last reading",
        most_ulps=8.0,
    ),
)
