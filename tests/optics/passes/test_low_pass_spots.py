"""Low-pass filters before sharp scenes that move or that a lens distorts: means of many places in float64."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.moving_frame import moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import LineTimes
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.vector_maps import VectorMap
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

LENS = ThinLens(50.0, 8.0, cos4=False)
ROWS, COLUMNS, PITCH_UM, APART_PX, TIME_S, LINE_S = 22, 34, 20.0, 2.6, 0.01, 2e-4
TURN_RAD_PER_S = 30.0  # counter-clockwise as seen, of photosites in the scene
ROLL = SteadyMotion(roll_deg_per_s=math.degrees(TURN_RAD_PER_S))
INNER = slice(6, -6), slice(6, -6)  # places outside see what goes on beyond the scene
FINE, INSTANTS = 12, 40


def camera_of(fill_factor: float = 1.0, **settings):
    return small_camera(
        COLUMNS, ROWS, pixel_pitch_um=PITCH_UM, low_pass_um=APART_PX * PITCH_UM, fill_factor=fill_factor, **settings
    )


def moving_plan(scene, motion: Motion, camera, lines: LineTimes | None = None) -> Plan:
    return plan_moving(Shot(scene, LENS, Exposure(TIME_S), camera, motion=motion, tolerance=0.05), lines)


def picture_of(scale: float) -> np.ndarray:
    return 0.1 + 0.9 * (np.random.default_rng(2).random((round(ROWS * scale), round(COLUMNS * scale))) < 0.5)


def read(picture: np.ndarray, x: np.ndarray, y: np.ndarray, is_bilinear: bool) -> np.ndarray:
    """Light at places of the picture [px], of even squares or bilinear between their middles."""
    if not is_bilinear:
        row, column = (np.clip(np.floor(at).astype(int), 0, side - 1) for at, side in zip((y, x), picture.shape, strict=True))
        return picture[row, column]
    (row, down), (column, right) = (
        (np.floor(np.clip(at - 0.5, 0.0, side - 1.001)).astype(int), np.clip(at - 0.5, 0.0, side - 1.001) % 1.0)
        for at, side in zip((y, x), picture.shape, strict=True)
    )
    upper = picture[row, column] * (1.0 - right) + picture[row, column + 1] * right
    lower = picture[row + 1, column] * (1.0 - right) + picture[row + 1, column + 1] * right
    return upper * (1.0 - down) + lower * down


def turned_truth(picture: np.ndarray, scale: float, fill_factor: float, line_s: float) -> np.ndarray:
    """Mean over places of the open area, spots and instants of what a camera sees that rolls, each row at its own time."""
    inside = math.sqrt(fill_factor) * ((np.arange(FINE) + 0.5) / FINE - 0.5)
    along = np.concatenate([inside - 0.5 * APART_PX, inside + 0.5 * APART_PX])
    y = (np.arange(ROWS) + 0.5 - 0.5 * ROWS)[:, None, None, None] + along[:, None]
    x = (np.arange(COLUMNS) + 0.5 - 0.5 * COLUMNS)[:, None, None] + along
    total = np.zeros((ROWS, COLUMNS))
    for part in (np.arange(INSTANTS) + 0.5) / INSTANTS:
        angle = (TURN_RAD_PER_S * (line_s * np.arange(ROWS) + TIME_S * part))[:, None, None, None]
        right, down = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
        seen = read(picture, scale * (right + 0.5 * COLUMNS), scale * (down + 0.5 * ROWS), scale < 1.0)
        total += seen.mean(axis=(2, 3)) / INSTANTS
    return total


@pytest.mark.parametrize("line_s", [0.0, LINE_S])
@pytest.mark.parametrize(
    ("scale", "fill_factor"),
    [(2.0, 1.0), (1.0, 0.64), (0.5, 0.64), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((1.5, 0.64), (1.0, 1.0)))],
)
def test_photosites_see_through_each_spot_what_is_there_at_their_own_time(scale, fill_factor, line_s):
    """A camera that rolls, at once and row by row, before scenes of more and fewer pixels than photosites."""
    picture = picture_of(scale)
    scene, camera = band_scene(picture, math.inf), camera_of(fill_factor)
    planned = moving_plan(scene, Motion(camera=ROLL), camera, rolling(ROWS, TIME_S, line_s) if line_s else None)
    assert planned.optics.sees_spots and planned.optics.psf is None
    error = np.abs(moving_light(planned) - turned_truth(picture, scale, fill_factor, line_s))[INNER]
    allowed = planned.optics.motion.error + 0.02  # of parts of tilted photosites, and of the places of the truth
    assert np.quantile(error, 0.99) < allowed and error.mean() < 0.2 * allowed


def test_a_window_has_the_bits_of_the_frame():
    scene, window = band_scene(picture_of(2.0), math.inf), Window(7, 5, 11, 9)
    whole, part = (
        moving_light(moving_plan(scene, Motion(camera=ROLL), camera_of(window=own), rolling(ROWS, TIME_S, LINE_S)))
        for own in (None, window)
    )
    assert np.array_equal(part, whole[5:14, 7:18])


def test_layers_that_move_apart_are_composited_before_the_filter():
    """An edge of alpha that passes light and dark: the mean of the frames that the spots see without a filter."""
    coverage = np.broadcast_to(np.arange(COLUMNS) >= 17, (ROWS, COLUMNS)).astype(np.float32)
    wall = Layer(picture_of(1.0).astype(np.float32)[..., None], 900.0)
    scene = band_scene(0.2 * coverage, 500.0, coverage=coverage, behind=(wall,))
    motion = Motion(layers={0: LayerMotion((Speed(300.0, "px/s"), Speed(0.0, "px/s")))})
    planned = moving_plan(scene, motion, camera_of())
    assert planned.optics.motion.method == "swept" and planned.optics.covering_layers == 2
    own = replace(camera_of(), low_pass_um=0.0)
    spots = [
        moving_light(replace(bare, optics=replace(bare.optics, projection=bare.optics.projection.at_spot(x, y))))
        for bare in [moving_plan(scene, motion, own)]
        for x, y in planned.optics.projection.spots
    ]
    assert np.abs(moving_light(planned) - np.mean(spots, axis=0)).max() < 1e-6


def test_pixels_that_move_by_vectors_are_seen_through_the_filter(tmp_path):
    """All to the right alike: as a layer that moves so."""
    picture = picture_of(1.0)
    np.save(tmp_path / "vectors.npy", np.broadcast_to(np.float32([200.0, 0.0]), (*picture.shape, 2)))
    scene = band_scene(picture, math.inf)
    by_vectors = moving_plan(scene, Motion(vectors=VectorMap(tmp_path / "vectors.npy", "px/s")), camera_of())
    as_layer = moving_plan(scene, Motion(layers={0: LayerMotion((Speed(200.0, "px/s"), Speed(0.0, "px/s")))}), camera_of())
    error = np.abs(moving_light(by_vectors) - moving_light(as_layer))[INNER]
    assert error.max() < by_vectors.optics.motion.error + as_layer.optics.motion.error + 1e-5


def test_a_distorted_picture_is_seen_at_each_spot():
    """Barrel distortion of even squares at rest: places of the open area and its spots, undistorted in float64."""
    picture = picture_of(2.0)
    lens = ThinLens(1.0, 8.0, cos4=False, distortion=Distortion(k1=-0.4))
    shot = Shot(band_scene(picture, math.inf), lens, Exposure(TIME_S), camera_of(), motion=Motion(), tolerance=0.05)
    planned = plan_moving(shot)
    warp, inside = planned.optics.projection.warp, (np.arange(FINE) + 0.5) / FINE - 0.5
    along = np.concatenate([inside - 0.5 * APART_PX, inside + 0.5 * APART_PX]) + 0.5
    y = np.arange(ROWS)[:, None, None, None] + along[:, None]
    x = np.arange(COLUMNS)[:, None, None] + along
    right, down = warp.undistorted(*np.broadcast_arrays(x, y))
    truth = read(picture, 2.0 * right, 2.0 * down, is_bilinear=False).mean(axis=(2, 3))
    assert planned.optics.sees_spots
    assert np.abs(moving_light(planned) - truth)[INNER].max() < 0.03  # upright parts, and places of the truth
