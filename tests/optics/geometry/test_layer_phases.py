"""Layers that move apart in scenes of another scale, averaged between photosites, against exact means in float64."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.layer_truth import dense_layers
from helpers.moving_frame import moving_light, plan_moving, rolling, without_edges
from helpers.scene_builders import band_scene

from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

LENS, TIME_S = ThinLens(50.0, 8.0, focus_distance_m=2000.0, cos4=False), 0.01
WIDTH, HEIGHT = 150, 24  # two spans of a row


def scaled_shot(scale: float, ways_px, cfa="MONO") -> Shot:
    """Two layers of hard squares, `scale` pixels per photosite, that move by ways in the exposure [px of the scene]."""
    height, width = round(HEIGHT * scale), round(WIDTH * scale)
    own = np.kron(np.random.default_rng(3).random((3, height // 3 + 1, width // 3 + 1)), np.ones((3, 3)))[:, :height, :width]
    light, cover = own[:2].astype(np.float32), np.round(own[2]).astype(np.float32)
    bands = np.float32(1.0) if cfa == "MONO" else np.array([1.0, 0.7, 0.4], np.float32)
    planes = [plane[..., None] * np.atleast_1d(bands) for plane in (light[0] * cover, light[1])]
    scene = band_scene(planes[0], 2000.0, coverage=cover, behind=(Layer(planes[1], 2000.1, None),))
    moves = {n: LayerMotion(tuple(Speed(way / TIME_S, "px/s") for way in own)) for n, own in enumerate(ways_px) if own}
    camera = small_camera(WIDTH, HEIGHT, cfa=cfa, pixel_pitch_um=40.0)
    return Shot(scene, LENS, Exposure(TIME_S), camera, motion=Motion(layers=moves), tolerance=0.3)


def dense_scaled(shot: Shot, projection: Projection, ways_px, opens_s: np.ndarray, instants: int | np.ndarray) -> np.ndarray:
    return dense_layers(shot.scene.load(), projection, ways_px, opens_s / TIME_S, WIDTH, instants)


SCALED = [(s, ((9.3, 3.1), (-4.2, 6.7))) for s in (0.4, 0.75, 1.3, 1.5, 2.0)]
SCALED += [(0.75, ((0.4, 6.0), None)), (1.3, ((3.6, -4.8), None)), (1.3, ((0.0, 7.0), (5.0, 0.0)))]


FEW = 0, 2, 4, 6  # fewer pixels than photosites, more, and whole numbers of them; what is at rest behind
WAYS = [pytest.param(*one, marks=[] if number in FEW else [pytest.mark.slow]) for number, one in enumerate(SCALED)]


@pytest.mark.parametrize(("scale", "ways_px"), WAYS)
def test_layers_of_another_scale_are_averaged_between_photosites_within_the_predicted_error(scale, ways_px):
    shot = scaled_shot(scale, ways_px)
    planned = plan_moving(shot)
    optics = planned.optics
    assert optics.motion.method == "swept" and optics.sweeps_shifted_layers() and optics.layer_phases is not None
    truth = dense_scaled(shot, optics.projection, ways_px, np.zeros(HEIGHT), 4 * optics.motion.count)
    assert np.quantile(np.abs(moving_light(without_edges(planned)) - truth), 0.999) < optics.motion.error


def test_places_that_hold_all_bends_read_even_squares_exactly():
    """With two pixels per photosite, and places at each of them, the same sum over the instants in float64."""
    ways_px = SCALED[0][1]
    shot = scaled_shot(2.0, ways_px)
    planned = plan_moving(shot)
    optics = planned.optics
    assert optics.layer_phases is not None and optics.layer_phases.instants == optics.motion.count
    borders = optics.motion.path.borders(optics.motion.count)
    truth = dense_scaled(shot, optics.projection, ways_px, np.zeros(HEIGHT), borders)
    assert np.abs(moving_light(without_edges(planned)) - truth).max() < 3e-6


@pytest.mark.parametrize("scale", [0.75, pytest.param(1.5, marks=pytest.mark.slow)])
def test_layers_of_another_scale_roll_and_a_crop_has_the_bits_of_the_frame(scale):
    ways_px, lines = SCALED[0][1], rolling(HEIGHT, TIME_S, 3e-4)
    shot = scaled_shot(scale, ways_px)
    optics = plan_moving(shot, lines).optics
    assert optics.sweeps_shifted_layers() and optics.layer_phases is not None
    found = moving_light(without_edges(plan_moving(shot, lines)))
    truth = dense_scaled(shot, optics.projection, ways_px, lines.opens_s, 2 * optics.motion.count)
    assert np.quantile(np.abs(found - truth), 0.999) < optics.motion.error
    coloured = plan_moving(scaled_shot(scale, ways_px, "RGGB"), lines)
    part = replace(coloured, optics=replace(coloured.optics, window=Window(17, 5, 90, 12)))
    found = moving_light(without_edges(coloured))
    assert coloured.optics.sweeps_shifted_layers() and np.array_equal(moving_light(without_edges(part)), found[5:17, 17:107])
    alone = moving_light(without_edges(replace(coloured, optics=coloured.optics.in_one_color(2))))
    assert np.array_equal(found[1::2, 1::2], alone[1::2, 1::2])
