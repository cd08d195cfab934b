"""Cases of the kernels of layers that move apart: composited at each instant, from means over photosites, or within them."""

import math
from dataclasses import replace

import numpy as np
from helpers.layer_truth import dense_layers, exact_layers
from helpers.moving_frame import plan_moving, without_edges
from helpers.scene_builders import band_scene

from simulator.device import Device
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.pipeline.planner import Plan
from simulator.scene.scene import Layer, Scene

from .inputs import number, picture
from .motion_cases import COLUMNS, ROWS, TIME_S, WAYS, WHY, outcome, shot_of
from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real

INSTANTS = 600  # of the truth: up to a fiftieth of a photosite apart
EXACT_INSTANTS = 300  # of the truth of cells, which is smooth over a photosite
DEPTHS_M = 2000.0, 2000.1  # both in focus


def run_layers(device: Device, inputs: Inputs) -> Outcome:
    """A picture with holes that moves before another that moves, by means over photosites."""
    planned, scene, ways = taken(inputs)
    truth = dense_layers(scene, planned.optics.projection, ways, np.zeros(ROWS), COLUMNS, INSTANTS)
    if planned.optics.motion is None:  # composited as it is
        truth = exact(planned, scene, ways, 1)
    return outcome(without_edges(planned), truth)


def run_cells(device: Device, inputs: Inputs) -> Outcome:
    """The same as photosites see it."""
    planned, scene, ways = taken(inputs)
    return outcome(planned, exact(planned, scene, ways, 1 if planned.optics.motion is None else EXACT_INSTANTS))


def taken(inputs: Inputs) -> tuple[Plan, Scene, list[tuple[float, float]]]:
    """Return the plan of a picture with holes before another, the scene, and the ways of both in the exposure [px]."""
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
    return planned, scene.load(), ways


def exact(planned: Plan, scene: Scene, ways: list[tuple[float, float]], instants: int) -> np.ndarray:
    """Radiance of the photosites."""
    layers = [(layer.planes[..., 0].astype(float), layer.coverage) for layer in scene.layers]
    return exact_layers(layers, planned.optics.projection, ways, np.zeros(ROWS), COLUMNS, instants)


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
    StressCase("layer_cells", ("layer_cells",), space((1.0, 1.5, 2.6)), run_cells, WHY, keeps=True),
)
