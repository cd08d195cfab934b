"""Cases of the kernels of layers that move apart: composited at each instant, from means over photosites, or within them."""

import math
from dataclasses import replace

import numpy as np
from helpers.layer_truth import dense_layers, exact_layers
from helpers.moving_frame import dense_mean, moving_light, plan_moving, rolling, without_edges
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates

from simulator.device import Device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.optics.defocus.aperture_samples import moving_samples
from simulator.optics.geometry.rows_between import PHASES
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene

from .inputs import number, picture
from .motion_cases import COLUMNS, DISTANCE_PX, PX_PER_DEGREE, ROWS, TIME_S, WAYS, WHY, outcome, shot_of
from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real

INSTANTS = 600  # of the truth: up to a fiftieth of a photosite apart
EXACT_INSTANTS = 300  # of the truth of cells, which is smooth over a photosite
DEPTHS_M = 2000.0, 2000.1  # both in focus
DRIFT_M = 2000.0, 2400.0  # far enough to be in focus at infinity, and apart in what they shift by


def run_layers(device: Device, inputs: Inputs) -> Outcome:
    """A picture with holes that moves before another that moves, by means over photosites."""
    planned, scene, ways = taken(inputs)
    truth = dense_layers(scene, planned.optics.projection, ways, np.zeros(ROWS), COLUMNS, INSTANTS)
    if len(planned.optics.scene.layers) == 1:  # composited as it is: at rest, or where both move alike
        truth = exact(planned, scene, ways, 1 if planned.optics.motion is None else EXACT_INSTANTS)
    return outcome(without_edges(planned), truth)


def run_cells(device: Device, inputs: Inputs) -> Outcome:
    """The same as photosites see it."""
    planned, scene, ways = taken(inputs)
    return outcome(planned, exact(planned, scene, ways, 1 if planned.optics.motion is None else EXACT_INSTANTS))


def run_drift(device: Device, inputs: Inputs) -> Outcome:
    """A picture with holes before another, past which a camera moves that turns, too: they drift along rows."""
    right, down = (-number(inputs, f"{name}_px") * DRIFT_M[0] / DISTANCE_PX / TIME_S for name in ("right", "down"))
    camera = SteadyMotion(
        right_m_per_s=right,
        up_m_per_s=-down,
        pan_deg_per_s=number(inputs, "pan_px") / PX_PER_DEGREE / TIME_S,
        roll_deg_per_s=number(inputs, "roll_deg") / TIME_S,
    )
    light, cover = taken_light(inputs, 1.0)
    shot = shot_of(light[1], number(inputs, "electrons"), Motion(camera=camera))
    scene = band_scene(light[0] * cover, DRIFT_M[0], coverage=cover, behind=(Layer(light[1][..., None], DRIFT_M[1], None),))
    row_s = number(inputs, "row_s")
    planned = without_edges(plan_moving(replace(shot, scene=scene), rolling(ROWS, TIME_S, row_s)))  # truth is of means
    pictures = [(light[0] * cover, cover, DRIFT_M[0]), (light[1], None, DRIFT_M[1])]
    if len(planned.optics.scene.layers) == 1:  # both are seen alike, and composited as they are
        pictures = [(light[0] * cover + (1.0 - cover) * light[1], None, DRIFT_M[0])]
    opens = row_s * np.arange(ROWS)
    truth = dense_mean(
        pictures, camera, planned.optics.projection, (ROWS, COLUMNS), DISTANCE_PX, opens, TIME_S, instants=INSTANTS
    )
    return outcome(planned, truth)


def taken_light(inputs: Inputs, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the light of two layers, (2, height, width), and the coverage of the first one."""
    light = np.resize(picture(inputs), (2, round(ROWS * scale), round(COLUMNS * scale))).astype(np.float32)
    return light, (light[0] > np.median(light[0])).astype(np.float32)


def taken(inputs: Inputs) -> tuple[Plan, Scene, list[tuple[float, float]]]:
    """Return the plan of a picture with holes before another, the scene, and the ways of both in the exposure [px]."""
    light, cover = taken_light(inputs, number(inputs, "scale"))
    ways = [(number(inputs, f"{name}_right_px"), number(inputs, f"{name}_down_px")) for name in ("near", "far")]
    moves = {n: LayerMotion((Speed(x / TIME_S, "px/s"), Speed(y / TIME_S, "px/s"))) for n, (x, y) in enumerate(ways)}
    shot = shot_of(light[1], number(inputs, "electrons"), Motion(layers=moves))
    behind = (Layer(light[1][..., None], DEPTHS_M[1], None),)
    scene = band_scene(light[0] * cover, DEPTHS_M[0], coverage=cover, behind=behind)
    planned = plan_moving(replace(shot, scene=scene, lens=replace(shot.lens, focus_distance_m=DEPTHS_M[0])))
    return planned, scene.load(), ways


def run_points(device: Device, inputs: Inputs) -> Outcome:
    """Both layers out of focus, at points of aperture and time: the same sums in float64."""
    shot, light, cover, ways = blurred(inputs)
    planned = without_edges(plan_moving(shot))
    optics, blur = planned.optics, planned.optics.moving_blur
    if not optics.samples_shifted_layers or blur is None:  # nothing moves
        return outcome(planned, moving_light(planned))
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(float)
    points = moving_samples(blur.pupil, optics.shifted_points, 1).astype(float)
    steps, truth = PHASES if optics.reads_rows else 1e9, np.zeros(x.shape)
    for right, below, share in points[:, [0, 1, 5]]:
        ends = [
            (np.rint(steps * (y + radius * below - share * down)) / steps, x + radius * right - share * across)
            for radius, (across, down) in zip(blur.radii_px, ways, strict=True)
        ]
        near, hidden, far = (
            map_coordinates(plane, place, order=1, mode="nearest")
            for plane, place in zip((light[0] * cover, cover, light[1]), (ends[0], ends[0], ends[1]), strict=True)
        )
        truth += (near + (1.0 - hidden) * far) / len(points)
    return outcome(planned, truth)


def blurred(inputs: Inputs) -> tuple[Shot, np.ndarray, np.ndarray, list[tuple[float, float]]]:
    """Return a shot of such layers before and behind the plane in focus, their light, coverage and ways [px]."""
    light = np.resize(picture(inputs), (2, ROWS, COLUMNS)).astype(np.float32)
    cover = (light[0] > np.median(light[0])).astype(np.float32)
    ways = [(number(inputs, f"{name}_right_px"), number(inputs, f"{name}_down_px")) for name in ("near", "far")]
    moves = {n: LayerMotion((Speed(x / TIME_S, "px/s"), Speed(y / TIME_S, "px/s"))) for n, (x, y) in enumerate(ways)}
    shot = shot_of(light[1], number(inputs, "electrons"), Motion(layers=moves))
    lens = replace(shot.lens, f_number=1.4, focus_distance_m=2.0, transmittance=0.03 * shot.lens.transmittance)
    behind = (Layer(light[1][..., None], number(inputs, "far_m"), None),)
    scene = band_scene(light[0] * cover, number(inputs, "near_m"), coverage=cover, behind=behind)
    return replace(shot, scene=scene, lens=lens, tolerance=1.0), light.astype(float), cover.astype(float), ways


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


POINTS = space((1.0,)) | {"near_m": Real(1.5, 1.9), "far_m": Real(2.1, 3.0)}
DRIFTING: dict[str, Domain] = {
    "light": Picture((2 * ROWS, COLUMNS), 1e-6, 10.0),
    **{f"{name}_px": Real(-6.0, 6.0, switches=WAYS) for name in ("right", "down")},
    "pan_px": Real(0.5, 6.0),  # by which layers drift; those that shift are `swept_layers`
    "roll_deg": Real(-0.3, 0.3, switches=(0.0, 0.01)),
    "row_s": Choice((0.0, 1e-5, 1e-4)),
    "electrons": Real(5.0, 2e4, log=True),
}

CASES = (
    StressCase(
        "rows_between",
        ("rows_between", "swept_layers"),
        {name: domain for name, domain in POINTS.items() if name != "scale"},
        run_points,
        "float32 sums over 2000 points: half of 2000 roundings of 2^-24, 0.01 sigma of 2e4 electrons; twice",
        most_sigma=0.02,
    ),
    StressCase("swept_layers", ("swept_layers",), space((1.0,)), run_layers, WHY, keeps=True),
    StressCase("layer_phases", ("layer_phases", "swept_layers"), space((1.5, 2.0)), run_layers, WHY, keeps=True),
    StressCase("drifting_layers", ("swept_layers",), DRIFTING, run_drift, WHY, keeps=True),
    StressCase("layer_cells", ("layer_cells",), space((1.0, 1.5, 2.6)), run_cells, WHY, keeps=True),
)
