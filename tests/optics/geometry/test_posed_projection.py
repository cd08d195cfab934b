"""Poses of the projection: what photosites see of a fine scene that moved, stretched, turned and distorted."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.moving_frame import plan_moving
from helpers.scene_builders import band_scene

from simulator.device import open_device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.posed_projection import posed
from simulator.optics.geometry.projection import Projection, project
from simulator.optics.lens.distortion import Distortion, plan_warp
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window
from simulator.sensor.camera.cfa import Cfa

WIDTH, HEIGHT, FINE = 64, 32, 4.0
SQUARES = (np.random.default_rng(5).random((round(HEIGHT * FINE), round(WIDTH * FINE))) < 0.5).astype(float)


@lru_cache(maxsize=1)
def moving() -> OpticsPlan:
    """Plan of a camera that turns before a picture."""
    picture = np.random.default_rng(3).random((HEIGHT, WIDTH))
    camera, motion = small_camera(WIDTH, HEIGHT, pixel_pitch_um=40.0), Motion(camera=SteadyMotion(pan_deg_per_s=15.0))
    lens = ThinLens(50.0, 8.0, cos4=False)
    return plan_moving(Shot(band_scene(picture, 1000.0), lens, Exposure(0.01), camera, motion=motion, tolerance=0.5)).optics


def posed_light(homography: np.ndarray, pixels: np.ndarray, allowed: float, **settings) -> tuple[Projection, np.ndarray]:
    """Projection of a scene of FINE x FINE pixels per photosite, and its light on the moved sensor. settings: of it."""
    still = Projection(FINE, 0.0, 0.0, *pixels.shape[::-1], round(FINE), False)
    projection = replace(posed(still, moving().motion, homography, allowed), **settings)
    device = open_device()
    planes = device.upload(pixels.astype(np.float32))
    light = project(device, projection, Cfa.uniform(0), Window(0, 0, WIDTH, HEIGHT), planes)
    return projection, device.download(light, (HEIGHT, WIDTH), np.float32)


@pytest.mark.parametrize("nearer", [0.0, 1e-3, 0.05, 0.3])
def test_a_zoom_keeps_all_light(nearer):
    """Photosites that see a wider part of a fine scene touch more of its pixels: a tenth was lost where 0.3 more are seen."""
    homography = np.array([[1.0 + nearer, 0.0, 0.013], [0.0, 1.0 + nearer, 0.017], [1e-3 * nearer, 0.0, 1.0]])
    _, light = posed_light(homography, np.ones_like(SQUARES), 1e-3)
    assert light == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("angle_rad", "allowed", "leans"),
    [(0.0, 0.0, False), (1e-9, 0.0, True), (4e-4, 1e-3, False), (1.7e-3, 1e-3, True), (np.pi / 2 - 4e-4, 1e-3, False)],
)
def test_photosites_that_hardly_lean_are_upright(angle_rad, allowed, leans):
    """Black and white squares against the exact means of their parallelograms."""
    turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad), 0.31], [np.sin(angle_rad), np.cos(angle_rad), 0.17], [0, 0, 1]])
    projection, light = posed_light(turn, SQUARES, allowed)
    _, truth = posed_light(turn, SQUARES, allowed, leans=True)
    assert projection.leans == leans
    assert np.quantile(np.abs(light - truth), 0.999) <= 0.2 * allowed + 2e-6


def test_a_lens_that_distorts_makes_photosites_lean():
    """k1 times twice the product of both places, at the corner; a roll adds to it."""
    warp = plan_warp(Distortion(k1=-0.02, unit="half_diagonal"), 1000.0, WIDTH, HEIGHT, 1)
    assert warp is not None
    corner = 0.5 * WIDTH * 0.5 * HEIGHT / (0.25 * (WIDTH**2 + HEIGHT**2))
    assert warp.tilt(WIDTH, HEIGHT) == pytest.approx(2.0 * 0.02 * corner, rel=0.2)
    still = replace(moving().projection, warp=warp)
    assert [posed(still, moving().motion, np.eye(3), allowed).leans for allowed in (0.1, 0.02)] == [False, True]


def test_a_camera_that_moves_sees_as_much_of_bilinear_light_as_one_at_rest():
    """Photosites behind a distortion are up to a fifth wider in the corner, which waves show: 0.7 % of the light."""
    lens = ThinLens(50.0, 8.0, cos4=False, distortion=Distortion(k1=0.06, unit="half_diagonal"))
    stripes = 1.0 + np.cos(2.0 * np.arange(WIDTH)) * np.cos(2.2 * np.arange(HEIGHT))[:, None]
    still = plan(Shot(band_scene(stripes, 1000.0), lens, Exposure(0.01), small_camera(WIDTH, HEIGHT))).optics.projection
    device = open_device()
    planes = device.upload(stripes.astype(np.float32))
    light = [
        device.download(project(device, one, Cfa.uniform(0), Window(0, 0, WIDTH, HEIGHT), planes), (HEIGHT, WIDTH), np.float32)
        for one in (still, posed(still, moving().motion, np.eye(3)))
    ]
    assert still.is_bilinear and still.has_pixel_per_photosite
    np.testing.assert_allclose(light[1], light[0], atol=3e-4)  # only one counts how far they lean
