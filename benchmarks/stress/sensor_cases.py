"""Cases of the sensor's kernels, and of the functions that they are made of."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from helpers.camera_builders import small_camera
from helpers.hdr_bench import DUAL_GAIN, HIGH, LOW, TWO_EXPOSURES, hdr_plan
from helpers.kernel_bench import Bench
from helpers.neighbors import binned, bloomed, crosstalk_stencil, stencil_sum
from helpers.scene_builders import band_scene
from helpers.stability_cases import Body, Case

from simulator.device import Device
from simulator.exposure.exposed_light import ExposedLight, LightComponent
from simulator.exposure.light_curve import SteadyLight
from simulator.exposure.line_exposure import add_exposed_lines, expose_lines
from simulator.exposure.line_times import LineTimes
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.own_colors import join_colors
from simulator.optics.veiling_glare import LEAST_OPEN, VeilingGlare, add_veiling_glare
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.readout_window import ReadoutGeometry
from simulator.sensor.camera.remosaic import Remosaic, remosaic_weights
from simulator.sensor.hdr_passes import read_noise_free_combined
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.kernel.kernel_launch import FrameSetting, tile_extremes
from simulator.sensor.kernel.noise_free import code_of_light, mean_electrons
from simulator.sensor.readout import (
    MOST_ELECTRONS,
    darken_optical_black,
    remosaic_variance,
    share_charge,
    share_with_neighbors,
    spill_charge,
)
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.irradiance import Irradiance
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Stage

from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real, Whole

ROWS, COLUMNS = 24, 36
SHAPE = ROWS, COLUMNS
FRAME = Window(0, 0, COLUMNS, ROWS)
ANY = Picture(SHAPE)
GROUPS = {2: "RRGG/RRGG/GGBB/GGBB", 3: "GGGRRR/GGGRRR/GGGRRR/BBBGGG/BBBGGG/BBBGGG"}
PATTERN = "GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG"  # X-Trans


def number(inputs: Inputs, name: str) -> float:
    """Return an input that is a number."""
    value = inputs[name]
    assert isinstance(value, float | int)
    return float(value)


def picture(inputs: Inputs, name: str = "light") -> np.ndarray:
    """Return an input that is a picture."""
    value = inputs[name]
    assert isinstance(value, np.ndarray)
    return value


def run_binning(device: Device, inputs: Inputs) -> Outcome:
    factor, step = int(number(inputs, "factor")), int(number(inputs, "step"))
    geometry = ReadoutGeometry(FRAME, FRAME, FRAME, step, Crosstalk(), Binning(factor, "charge"))
    sums, area = share_charge(device, geometry, device.upload(picture(inputs))), geometry.binned
    exact = binned(picture(inputs).astype(np.float64), factor, step)
    return Outcome(device.download(sums, (area.height, area.width), np.float32), exact)


def run_crosstalk(device: Device, inputs: Inputs) -> Outcome:
    side, corner = (float(np.float32(number(inputs, name))) for name in ("side", "corner"))
    light = picture(inputs)
    found = device.download(share_with_neighbors(device, device.upload(light), FRAME, (side, corner)), SHAPE, np.float32)
    own = light.astype(np.float64)
    exact = stencil_sum(own, crosstalk_stencil(side, corner))
    return Outcome(found, exact, exact + 8.0 * (side + corner) * own)  # own light is taken off, and added


def plan_of(**settings: Any) -> Plan:
    """Return the plan of a shot of even light with a camera of these settings, of the size of the pictures."""
    camera = small_camera(COLUMNS, ROWS, **settings)
    return plan(Shot(band_scene(np.ones((ROWS, COLUMNS, camera.channels))), ThinLens(50.0, 8.0), Exposure(0.01), camera))


def run_blooming(device: Device, inputs: Inputs) -> Outcome:
    sides, reach = int(number(inputs, "sides")), int(number(inputs, "reach"))
    capacity_e = float(np.float32(number(inputs, "capacity")))
    blooming = Blooming("column" if sides == 2 else "four", reach)
    planned = plan_of(stages={"full_well": FullWell(capacity_e)}, blooming=blooming)
    charge = device.upload(picture(inputs))
    spill_charge(device, planned.sensor, charge)
    exact, _ = bloomed(picture(inputs).astype(np.float64), capacity_e, sides, reach)
    return Outcome(
        device.download(charge, SHAPE, np.float32), exact, np.full(SHAPE, max(capacity_e, float(picture(inputs).max())))
    )


def run_remosaic(device: Device, inputs: Inputs) -> Outcome:
    """The variance after remosaic: weights are squared, so that nothing cancels."""
    cfa = GROUPS[int(number(inputs, "group"))]
    geometry = plan_of(cfa=cfa, remosaic=Remosaic()).sensor.readout
    pattern, light = Cfa.named(cfa), picture(inputs).astype(np.float64)
    found = remosaic_variance(device, geometry, picture(inputs))
    weights, (rows, columns) = remosaic_weights(pattern).astype(np.float64), pattern.period
    reach = pattern.group
    wide = np.pad(light, reach)
    for place in range(reach):  # beyond the edge stands the photosite one period further in
        wide[place], wide[-1 - place] = wide[place + rows], wide[-1 - place - rows]
    for place in range(reach):
        wide[:, place], wide[:, -1 - place] = wide[:, place + columns], wide[:, -1 - place - columns]
    exact = np.zeros(SHAPE)
    for y, x in np.ndindex(SHAPE):
        own = weights[y % rows, x % columns]
        around = wide[y : y + 2 * reach + 1, x : x + 2 * reach + 1]
        exact[y, x] = (own**2 * around).sum() + (0.0 if own.max() == 1.0 else 1.0 / 12.0)
    return Outcome(found, np.minimum(exact, np.float32(MOST_ELECTRONS)))


def run_own_color(device: Device, inputs: Inputs) -> Outcome:
    optics, images = plan_of(cfa=PATTERN).optics, [picture(inputs, name) for name in ("red", "green", "blue")]
    found = device.download(
        join_colors(optics, device, lambda own: device.upload(images[own.cfa.colors[0]])), SHAPE, np.float32
    )
    rows = PATTERN.split("/")
    exact = [[images["RGB".index(rows[y % len(rows)][x % len(rows[0])])][y, x] for x in range(COLUMNS)] for y in range(ROWS)]
    return Outcome(found, np.array(exact, np.float64))


def run_optical_black(device: Device, inputs: Inputs) -> Outcome:
    left, top = int(number(inputs, "left")), int(number(inputs, "top"))
    light, exact = device.upload(picture(inputs)), picture(inputs).astype(np.float64)
    darken_optical_black(device, light, Window(3, 5, COLUMNS, ROWS), Window(left, top, 9, 7))
    y, x = np.mgrid[5 : 5 + ROWS, 3 : 3 + COLUMNS]
    exact[(x < left) | (x >= left + 9) | (y < top) | (y >= top + 7)] = 0.0
    return Outcome(device.download(light, SHAPE, np.float32), exact)


def run_line_exposure(device: Device, inputs: Inputs) -> Outcome:
    axis = str(inputs["axis"])
    count = {"rows": ROWS, "columns": COLUMNS, "all": 1}[axis]
    lengths = np.maximum(picture(inputs, "lengths")[0, :count].astype(np.float64), 1e-30)
    lengths = lengths / lengths.max()
    zero = np.zeros(count)
    lines = LineTimes(axis, zero, zero, lengths, lengths, np.ones(count))  # type: ignore[arg-type]
    exposed = ExposedLight((LightComponent(False, SteadyLight(), (lines,), 0.0, 1.0),), axis, "")  # type: ignore[arg-type]
    mosaic = device.upload(picture(inputs))
    expose_lines(device, mosaic, FRAME, exposed, exposed.components[0])
    add_exposed_lines(device, mosaic, device.upload(picture(inputs, "flash")), FRAME, exposed, exposed.components[0])
    shares = np.minimum(lengths / lengths.max(), 1.0)
    shares = shares[:, None] if axis == "rows" else shares
    exact = (picture(inputs).astype(np.float64) + picture(inputs, "flash")) * shares
    return Outcome(device.download(mosaic, SHAPE, np.float32), exact)


def run_tile_range(device: Device, inputs: Inputs) -> Outcome:
    height, light = int(number(inputs, "tile_height")), picture(inputs)
    edges = np.unique([*range(0, ROWS, height), ROWS])
    found = tile_extremes(device, device.upload(light), COLUMNS, edges, height)
    parts = [light[first:last].astype(np.float64) for first, last in zip(edges, edges[1:], strict=False)]
    return Outcome(found, np.stack([[part.min(axis=0) for part in parts], [part.max(axis=0) for part in parts]]))


def run_camera_planes(device: Device, inputs: Inputs) -> Outcome:
    planes = picture(inputs, "planes")
    weights = np.float32(number(inputs, "weight")) * picture(inputs, "weights")
    buffer = camera_planes(device, Layer(planes, 1.0), weights, False)
    found = device.download(buffer, (weights.shape[1], *planes.shape[:2]), np.float32)
    with np.errstate(over="ignore"):
        exact = np.einsum("yxb,bc->cyx", planes.astype(np.float64), weights.astype(np.float64))
    return Outcome(found, exact)


def irradiance_of(inputs: Inputs) -> Irradiance:
    """Return the lens of these inputs, whose axis meets the middle of a sensor: whole or half photosites."""
    shares = tuple(np.linspace(1.0, number(inputs, "corner_share"), 5).tolist())
    centre_px = 0.5 * round(2.0 * number(inputs, "centre_px"))
    return Irradiance(number(inputs, "solid_angle_sr"), number(inputs, "tan2_per_px2"), centre_px, 12.5, shares, 0.05)


def vignetting_size(lens: Irradiance, x: int, y: int) -> np.ndarray:
    """Return the fall-off without the vignetting: the share of the pupil is a difference of shares near 1."""
    return relative_illumination(replace(lens, vignetting=()), x, y) / lens.effective_solid_angle_sr


def relative_illumination(lens: Irradiance, x: int, y: int) -> np.ndarray:
    """Return irradiance over radiance of each photosite of a frame at (x, y) [sr], float64."""
    rows, columns = np.mgrid[y : y + ROWS, x : x + COLUMNS].astype(np.float64) + 0.5
    radius_px = np.hypot(columns - lens.centre_x_px, rows - lens.centre_y_px)
    return lens.effective_solid_angle_sr * np.asarray(lens.relative_illumination(radius_px))


LENS_SPACE: dict[str, Domain] = {
    "solid_angle_sr": Real(1e-8, 3.0, log=True),
    "tan2_per_px2": Real(1e-16, 1e-2, log=True),
    "centre_px": Real(-30.0, 6000.0, switches=(0.5, 18.0)),
    "corner_share": Real(0.0, 1.0),
    "x": Choice((0, 1, 4095, 65535, 2**24 - 1 - COLUMNS)),
    "y": Choice((0, 1, 8191)),
}


def run_veiling_glare(device: Device, inputs: Inputs) -> Outcome:
    """The veil is divided by the fall-off by which the light is multiplied later: what arrives on the sensor is compared."""
    lens, cfa = irradiance_of(inputs), Cfa.uniform(0)
    window = Window(int(number(inputs, "x")), int(number(inputs, "y")), COLUMNS, ROWS)
    veil, share, mosaic = number(inputs, "veil"), number(inputs, "share"), device.upload(picture(inputs))
    add_veiling_glare(device, mosaic, VeilingGlare(share, np.array([veil])), lens, cfa.macros(0, 0), window)
    arrived, stages = (
        device.empty(SHAPE, np.float32),
        (lens, Integration(1.0, 1.0), STAGES["analog_gain"](1.0), STAGES["adc"](8, 0.0)),
    )
    mean_electrons(device, mosaic, arrived, SHAPE, [FrameSetting(stages, x=window.x, y=window.y)])
    open_sr = relative_illumination(lens, window.x, window.y)
    with np.errstate(over="ignore"):
        veiled = veil * np.minimum(open_sr / (LEAST_OPEN * lens.effective_solid_angle_sr), 1.0)
        exact = (1.0 - share) * picture(inputs).astype(np.float64) * open_sr + veiled
    size = vignetting_size(lens, window.x, window.y) * lens.effective_solid_angle_sr * picture(inputs)
    fades = open_sr < 2.0 * LEAST_OPEN * lens.effective_solid_angle_sr  # with a share that is a difference of shares near 1
    return Outcome(device.download(arrived, SHAPE, np.float32), exact, size + np.where(fades, veil / LEAST_OPEN, veiled))


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


def function_case(
    name: str, include: str, expression: str, exact: Callable[[np.ndarray], np.ndarray], space: Real, most_ulps: float, why: str
) -> StressCase:
    """Return the case of a function of one number, of a header of kernels/; 256 numbers around the input are tried at once."""

    def run(device: Device, inputs: Inputs) -> Outcome:
        middle = np.float32(number(inputs, "x"))
        steps = np.arange(-128, 128, dtype=np.int64)
        values = (middle.view(np.int32).astype(np.int64) + steps).clip(0, 0x7F7FFFFF).astype(np.int32).view(np.float32)
        if middle < 0.0:
            values = middle + np.float32(np.spacing(middle)) * steps.astype(np.float32)
        values = values[(values >= space.low) & (values <= space.high)]
        found = Bench(device).header(include, expression, {"x": values})
        return Outcome(found, exact(values.astype(np.float64)))

    return StressCase(name, (), {"x": space}, run, why, most_ulps=most_ulps)


NORMAL = Real(1.2e-38, 8e37, log=True)
FUNCTIONS = (
    function_case(
        "reciprocal", "plain_math.h", "reciprocal(x)", lambda x: 1.0 / x, NORMAL, 3.4, "2e-7 of three Newton steps: 3.4 ulps"
    ),
    function_case(
        "reciprocal_square_root",
        "plain_math.h",
        "reciprocal_square_root(x)",
        lambda x: x**-0.5,
        NORMAL,
        14.0,
        "8e-7 of one Newton step from 0.065 %: 14 ulps",
    ),
    function_case(
        "exponential",
        "plain_math.h",
        "exponential(x)",
        np.exp,
        Real(-80.0, 80.0, switches=(0.0, math.log(2.0) / 2.0)),
        672.0,
        "5e-7 times 80, where the product with log2 e has lost that much: 672 ulps; Poisson numbers need it up to 10: 84",
    ),
)

CASES = (
    StressCase(
        "binning",
        ("binning",),
        {"light": ANY, "factor": Choice((2, 3, 4)), "step": Choice((1, 2))},
        run_binning,
        "a sum of up to 16 positive numbers: 15 roundings",
        most_ulps=15.0,
    ),
    StressCase(
        "crosstalk",
        ("crosstalk",),
        {"light": Picture(SHAPE, most=1e37), "side": Real(0.0, 0.12), "corner": Real(0.0, 0.12)},
        run_crosstalk,
        "seven roundings of a sum, each of which may lie in the next binade",
        most_ulps=7.0,
    ),
    StressCase(
        "blooming",
        ("blooming",),
        {
            "light": Picture(SHAPE, most=1e12),
            "capacity": Real(1.0, 1e6, log=True),
            "sides": Choice((2, 4)),
            "reach": Choice((1, 3, 9)),
        },
        run_blooming,
        "of the largest charge: at each of 9 steps seven roundings of each of 4 packets",
        most_ulps=252.0,
    ),
    StressCase(
        "remosaic",
        ("remosaic",),
        {"light": Picture(SHAPE, most=1e12), "group": Choice((2, 3))},
        run_remosaic,
        "a sum of 49 products, a square of each weight, and one more sum",
        most_ulps=102.0,
    ),
    StressCase(
        "own_color",
        ("own_color",),
        {"red": ANY, "green": ANY, "blue": ANY},
        run_own_color,
        "numbers are copied",
        most_ulps=0.0,
    ),
    StressCase(
        "optical_black",
        ("optical_black",),
        {"light": ANY, "left": Whole(0, COLUMNS + 9), "top": Whole(0, ROWS + 9)},
        run_optical_black,
        "numbers are copied or set to 0",
        most_ulps=0.0,
    ),
    StressCase(
        "line_exposure",
        ("line_exposure",),
        {
            "light": Picture(SHAPE, most=1e37),
            "flash": Picture(SHAPE, most=1e37),
            "lengths": Picture((1, COLUMNS), 1e-12, 1e6),
            "axis": Choice(("rows", "columns", "all")),
        },
        run_line_exposure,
        "shares of lines that differ by less than 1e-6 are 1: 16.8 ulps; two products and a sum",
        most_ulps=20.0,
    ),
    StressCase(
        "tile_range",
        ("tile_range",),
        {"light": ANY, "tile_height": Choice((2, 5, 16, 24))},
        run_tile_range,
        "numbers are compared",
        most_ulps=0.0,
    ),
    StressCase(
        "camera_planes",
        ("camera_planes",),
        {
            "planes": Picture((6, 9, 31), 1e-30, 1e18),
            "weights": Picture((31, 3), 1e-12, 1e3),
            "weight": Real(1e-6, 1e6, log=True),
        },
        run_camera_planes,
        "31 products and their sum in order",
        most_ulps=32.0,
    ),
    StressCase(
        "veiling_glare",
        ("veiling_glare",),
        {"light": Picture(SHAPE, most=1e37), "veil": Real(1e-30, 1e25, log=True), "share": Real(0.0, 0.3), **LENS_SPACE},
        run_veiling_glare,
        "of cos^4: 17.8 roundings, of the vignetting 16, of reciprocal and products 8",
        most_ulps=45.0,
    ),
    StressCase(
        "truth_electrons",
        ("truth",),
        {"light": LIGHT, **LENS_SPACE, **STAGE_SPACE},
        run_truth_electrons,
        "of cos^4 and solid angle 24.8 roundings (test_stability.py), of the vignetting 16",
        most_ulps=41.0,
    ),
    StressCase(
        "truth_code",
        ("truth",),
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
        ("hdr_readout",),
        {"light": Picture(SHAPE, 1e-6, 1e9), "readout": Choice(("gains", "exposures"))},
        run_hdr_readout,
        "three rounded products and four sums, times the factor of the last reading",
        most_ulps=8.0,
    ),
    *FUNCTIONS,
)
