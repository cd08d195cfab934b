"""Cases of the kernels by which photosites share charge, and which say whose colour or darkness a photosite has."""

from typing import Any

import numpy as np
from helpers.camera_builders import small_camera
from helpers.neighbors import binned, binned_variance, bloomed, crosstalk_stencil, stencil_sum
from helpers.scene_builders import band_scene

from simulator.device import Device
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.own_colors import join_colors
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.readout_window import ReadoutGeometry
from simulator.sensor.camera.remosaic import Remosaic, remosaic_weights
from simulator.sensor.readout import (
    MOST_ELECTRONS,
    darken_optical_black,
    remosaic_variance,
    share_charge,
    share_variance,
    share_with_neighbors,
    spill_charge,
)
from simulator.sensor.stages.full_well import FullWell

from .inputs import ANY, COLUMNS, FRAME, ROWS, SHAPE, number, picture
from .search import Outcome, StressCase
from .space import Choice, Inputs, Picture, Real, Whole

GROUPS = {2: "RRGG/RRGG/GGBB/GGBB", 3: "GGGRRR/GGGRRR/GGGRRR/BBBGGG/BBBGGG/BBBGGG"}
PATTERN = "GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG"  # X-Trans


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


def run_crosstalk_variance(device: Device, inputs: Inputs) -> Outcome:
    side, corner, factor, step = (number(inputs, name) for name in ("side", "corner", "factor", "step"))
    crosstalk, binning = Crosstalk(electrical=side, electrical_corner=corner), Binning(int(factor), "charge")
    geometry, light = ReadoutGeometry(FRAME, FRAME, FRAME, int(step), crosstalk, binning), picture(inputs)
    found = share_variance(device, geometry, device.upload(light), is_summed=True)
    exact = binned_variance(light.astype(np.float64), crosstalk_stencil(side, corner), int(factor), int(step))
    return Outcome(device.download(found, (geometry.binned.height, geometry.binned.width), np.float32), exact)


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


def remosaic_sum(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sum of the photosites around each, float64. weights: (period, period, taps, taps) of each place of the pattern."""
    (rows, columns), reach = weights.shape[:2], weights.shape[2] // 2
    wide = np.pad(values, reach)
    for place in range(reach):  # beyond the edge stands the photosite one period further in
        wide[place], wide[-1 - place] = wide[place + rows], wide[-1 - place - rows]
    for place in range(reach):
        wide[:, place], wide[:, -1 - place] = wide[:, place + columns], wide[:, -1 - place - columns]
    taps = weights.shape[2]
    return np.array(
        [
            [(weights[y % rows, x % columns] * wide[y : y + taps, x : x + taps]).sum() for x in range(values.shape[1])]
            for y in range(values.shape[0])
        ]
    )


def run_remosaic(device: Device, inputs: Inputs) -> Outcome:
    """The variance after remosaic: weights are squared, so that nothing cancels."""
    cfa = GROUPS[int(number(inputs, "group"))]
    sensor = plan_of(cfa=cfa, remosaic=Remosaic()).sensor
    pattern, light = Cfa.named(cfa), picture(inputs).astype(np.float64)
    found = remosaic_variance(device, sensor, picture(inputs))
    weights, (rows, columns) = remosaic_weights(pattern).astype(np.float64), pattern.period
    rounded = np.where(weights.max(axis=(2, 3)) == 1.0, 0.0, 1.0 / 12.0)
    exact = remosaic_sum(light, weights**2) + np.tile(rounded, (ROWS // rows, COLUMNS // columns))
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


CASES = (
    StressCase(
        "binning",
        ("bin_electrons",),
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
        "crosstalk_variance",
        ("crosstalk_variance",),
        {
            "light": Picture(SHAPE, most=1e35),
            "side": Real(0.0, 0.12),
            "corner": Real(0.0, 0.12),
            "factor": Choice((2, 3, 4)),
            "step": Choice((1, 2)),
        },
        run_crosstalk_variance,
        "a sum of up to 81 positive products, of a rounded weight that is taken twice",
        most_ulps=85.0,
    ),
    StressCase(
        "blooming",
        ("blooming_start", "blooming_step"),
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
        ("remosaic_signal",),
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
)
