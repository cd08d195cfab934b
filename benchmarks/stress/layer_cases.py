"""Cases of the kernels of layers that move apart: composited at each instant, from their pixels or from means of them."""

import math
from dataclasses import replace

import numpy as np
from helpers.layer_truth import dense_layers, dense_points
from helpers.moving_frame import plan_moving
from helpers.scene_builders import band_scene

from simulator.device import Device
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.scene.scene import Layer

from .inputs import number, picture
from .motion_cases import COLUMNS, ROWS, TIME_S, WAYS, WHY, outcome, shot_of
from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real

INSTANTS = 600  # of the truth: up to a fiftieth of a photosite apart
DEPTHS_M = 2000.0, 2000.1  # both in focus


def run_layers(device: Device, inputs: Inputs) -> Outcome:
    """A picture with holes that moves before another that moves."""
    scale = number(inputs, "scale")
    shape = round(ROWS * scale), round(COLUMNS * scale)
    light = np.resize(picture(inputs), (2, *shape)).astype(np.float32)
    cover = (light[0] > np.median(light[0])).astype(np.float32)
    ways = [(number(inputs, f"{name}_right_px"), number(inputs, f"{name}_down_px")) for name in ("near", "far")]
    moves = {n: LayerMotion((Speed(x / TIME_S, "px/s"), Speed(y / TIME_S, "px/s"))) for n, (x, y) in enumerate(ways)}
    shot = shot_of(light[1], number(inputs, "electrons"), Motion(layers=moves))
    behind = (Layer(light[1][..., None], DEPTHS_M[1], None),)
    scene = band_scene(light[0] * cover, DEPTHS_M[0], coverage=cover, behind=behind)
    planned = plan_moving(replace(shot, scene=scene, lens=replace(shot.lens, focus_distance_m=DEPTHS_M[0])))
    told = scene.load(), planned.optics.projection, ways
    if planned.optics.motion is None:  # composited as it is; else means over photosites are, to what the budget tells
        return outcome(planned, dense_points(*told, (ROWS, COLUMNS), 1))
    return outcome(planned, dense_layers(*told, np.zeros(ROWS), COLUMNS, INSTANTS))


def space(scales: tuple[float, ...]) -> dict[str, Domain]:
    """What is varied. scales: pixels of the scene per photosite."""
    largest = math.ceil(max(scales) * ROWS), math.ceil(max(scales) * COLUMNS)
    return {
        "light": Picture((2 * largest[0], largest[1]), 1e-6, 10.0),
        "scale": Choice(scales),
        **{f"{name}_px": Real(-6.0, 6.0, switches=WAYS) for name in ("near_right", "near_down", "far_right", "far_down")},
        "electrons": Real(5.0, 2e4, log=True),
    }


CASES = (
    StressCase("swept_layers", ("swept_layers",), space((1.0,)), run_layers, WHY, keeps=True),
    StressCase("layer_phases", ("layer_phases", "swept_layers"), space((1.5, 2.0)), run_layers, WHY, keeps=True),
)
