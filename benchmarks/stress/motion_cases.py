"""Cases of the kernels of a scene or a camera that moves, and of the whole chain."""

import math
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from helpers.camera_builders import small_camera
from helpers.moving_frame import dense_mean, moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates

from simulator.device import Device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.vector_maps import VectorMap
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot

from .inputs import number, picture
from .search import Outcome, StressCase, promised_sigma
from .space import Choice, Domain, Inputs, Picture, Real

ROWS, COLUMNS, TIME_S, PITCH_UM = 20, 36, 0.01, 40.0
LENS = ThinLens(50.0, 8.0, cos4=False)
DISTANCE_PX = 1e3 * LENS.image_distance_mm / PITCH_UM
INSTANTS = 1200  # of the truth: up to half a hundredth of a photosite apart
TOLERANCE = 0.1
PX_PER_DEGREE = DISTANCE_PX * math.pi / 180.0  # of a pan, on the axis


def shot_of(light: np.ndarray, electrons: float, motion: Motion) -> Shot:
    """Return a sharp shot of a picture, with so many electrons at radiance 1 in the exposure time."""
    camera = small_camera(COLUMNS, ROWS, pixel_pitch_um=PITCH_UM)
    shot = Shot(band_scene(light, math.inf), LENS, Exposure(TIME_S), camera, motion=motion, tolerance=TOLERANCE)
    lens = replace(LENS, transmittance=min(electrons / electrons_at_one(), 1.0))
    return replace(shot, lens=lens)


@cache
def electrons_at_one() -> float:
    """Return the electrons of a photosite at radiance 1 behind the clear lens."""
    camera = small_camera(COLUMNS, ROWS, pixel_pitch_um=PITCH_UM)
    still = Motion(camera=SteadyMotion(pan_deg_per_s=1.0))
    shot = Shot(band_scene(np.ones((ROWS, COLUMNS)), math.inf), LENS, Exposure(TIME_S), camera, motion=still)
    optics = plan_moving(shot).optics
    return float(optics.accuracy.electrons_per_radiance * optics.weights.sum())


def outcome(planned: Plan, truth: np.ndarray) -> Outcome:
    """Electrons of each photosite. truth: radiance."""
    optics = planned.optics
    electrons = float(optics.accuracy.electrons_per_radiance * optics.weights.sum())
    return Outcome(electrons * moving_light(planned), electrons * truth, promised_sigma=promised_sigma(planned))


def inside(frame: Outcome, margin: int) -> Outcome:
    """Return a frame without its margin."""
    inner = slice(margin, -margin), slice(margin, -margin)
    return replace(frame, found=frame.found[inner], exact=frame.exact[inner])


def swept(inputs: Inputs, by_instants: bool) -> Outcome:
    """A picture that a camera pans and rolls over, its rows read out one after the other."""
    scale = number(inputs, "scale")
    light = np.resize(picture(inputs), (round(scale * ROWS), round(scale * COLUMNS))).astype(np.float64)
    motion = SteadyMotion(
        pan_deg_per_s=number(inputs, "way_px") / PX_PER_DEGREE / TIME_S, roll_deg_per_s=number(inputs, "roll_deg") / TIME_S
    )
    row_s = number(inputs, "row_s")
    planned = plan_moving(shot_of(light, number(inputs, "electrons"), Motion(camera=motion)), rolling(ROWS, TIME_S, row_s))
    path = planned.optics.motion
    if by_instants and path is not None:
        planned = replace(planned, optics=replace(planned.optics, motion=replace(path, method="instants")))
    projection, opens = planned.optics.projection, row_s * np.arange(ROWS)
    truth = dense_mean(
        [(light, None, math.inf)], motion, projection, (ROWS, COLUMNS), DISTANCE_PX, opens, TIME_S, instants=INSTANTS
    )
    return outcome(planned, truth)


def run_swept_projection(device: Device, inputs: Inputs) -> Outcome:
    return swept(inputs, False)


def run_weighted_light(device: Device, inputs: Inputs) -> Outcome:
    return swept(inputs, True)


def run_swept_shift(device: Device, inputs: Inputs) -> Outcome:
    """A picture that moves without a turn, its rows read out one after the other."""
    light = picture(inputs).astype(np.float64)
    right, down, row_s = (number(inputs, name) for name in ("right_px", "down_px", "row_s"))
    motion = Motion(layers={0: LayerMotion((Speed(right / TIME_S, "px/s"), Speed(down / TIME_S, "px/s")))})
    planned = plan_moving(shot_of(light, number(inputs, "electrons"), motion), rolling(ROWS, TIME_S, row_s))
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    truth, began = np.zeros((ROWS, COLUMNS)), row_s / TIME_S * np.arange(ROWS)[:, None]
    for part in (np.arange(INSTANTS) + 0.5) / INSTANTS:
        come = began + part
        truth += map_coordinates(light, (y - down * come, x - right * come), order=1, mode="nearest") / INSTANTS
    moved, accuracy = (
        outcome(planned, truth),
        planned.optics.accuracy,
    )  # what is skipped counts in the noise of the brightest light
    return replace(moved, sigma=np.maximum(np.sqrt(moved.exact), accuracy.sigma * accuracy.electrons))


def run_swept_vectors(device: Device, inputs: Inputs) -> Outcome:
    """A picture whose pixels all move alike: the picture, moved."""
    light = picture(inputs).astype(np.float64)
    right, down = number(inputs, "right_px"), number(inputs, "down_px")
    velocity = np.broadcast_to(np.float32([right / TIME_S, down / TIME_S]), (ROWS, COLUMNS, 2))
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "vectors.npy", velocity)
        motion = Motion(vectors=VectorMap(Path(folder) / "vectors.npy", "px/s"))
        planned = plan_moving(shot_of(light, number(inputs, "electrons"), motion))
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    truth = np.zeros((ROWS, COLUMNS))
    for part in (np.arange(INSTANTS) + 0.5) / INSTANTS:
        truth += map_coordinates(light, (y - down * part, x - right * part), order=1, mode="nearest") / INSTANTS
    return inside(outcome(planned, truth), 7)  # what moves in from beyond the picture is unknown


WAYS = (0.0, 0.01, 0.1, 1.0, 2.0, 4.0)  # photosites
MOVING: dict[str, Domain] = {
    "light": Picture((ROWS, COLUMNS), 1e-6, 10.0),
    "way_px": Real(-6.0, 6.0, switches=WAYS),
    "roll_deg": Real(-3.0, 3.0, switches=(0.0, 0.01)),
    "row_s": Choice((0.0, 1e-5, 1e-4)),
    "scale": Choice((0.4, 0.75, 1.0, 1.0)),  # scene pixels per photosite
    "electrons": Real(5.0, 2e4, log=True),
}
SHIFTING: dict[str, Domain] = {
    "light": Picture((ROWS, COLUMNS), 1e-6, 10.0),
    "right_px": Real(-6.0, 6.0, switches=WAYS),
    "down_px": Real(-6.0, 6.0, switches=WAYS),
    "row_s": Choice((0.0, 1e-5, 1e-4)),
    "electrons": Real(5.0, 2e4, log=True),
}
WHY = "the shot's error budget, for 99.9 % of the photosites, each in its own noise"

CASES = (
    StressCase("swept_projection", ("swept_rows", "swept_places"), MOVING, run_swept_projection, WHY, keeps=True),
    StressCase("swept_shift", ("swept_shift",), SHIFTING, run_swept_shift, WHY, most_sigma=0.5),
    StressCase("weighted_light", ("weighted_light",), MOVING, run_weighted_light, WHY, keeps=True),
    StressCase(
        "swept_vectors",
        ("swept_vectors",),
        {
            "light": Picture((ROWS, COLUMNS), 1e-6, 10.0),
            "right_px": Real(-6.0, 6.0, switches=WAYS),
            "down_px": Real(-6.0, 6.0, switches=WAYS),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_swept_vectors,
        WHY,
        keeps=True,
    ),
)
