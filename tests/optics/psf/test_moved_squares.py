"""Even squares of light behind a lens that move: against the transfer function of the pupil in float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, lens
from helpers.moving_frame import moving_light
from helpers.pupil_truth import through_pupil
from helpers.scene_builders import band_scene

from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate

SIZE, PARTS, INSTANTS, BEYOND_PX = (72, 96), 8, 64, 100  # photosites, squares of the truth to each


def squares(scale: int, side: int) -> np.ndarray:
    counts = [round(size * scale / side) for size in SIZE]
    return np.kron(0.05 + 0.95 * (np.random.default_rng(2).random(counts) < 0.5), np.ones((side, side)))


def moved_shot(planes: np.ndarray, f_number: float, way: tuple[float, float]) -> Shot:
    """Shot of 2,000 e-, during which the scene moves by so many of its pixels to the right and down."""
    through = dataclasses.replace(lens(f_number), diffraction=True)
    still = Shot(band_scene(planes, math.inf), through, EXPOSURE, green_camera(*SIZE[::-1]))
    time_s = EXPOSURE.time_s * 2000.0 / plan(still).optics.accuracy.electrons
    right, down = (Speed(one / time_s, "px/s") for one in way)
    exposure = dataclasses.replace(EXPOSURE, time_s=time_s)
    return dataclasses.replace(still, exposure=exposure, motion=Motion(layers={0: LayerMotion((right, down))}))


@pytest.mark.parametrize(
    ("scale", "side", "f_number", "way_px"),
    [(2, 3, 8.0, (0.5, 0.0)), (2, 3, 2.8, (8.0, 0.0)), (4, 8, 2.8, (8.0, 0.0)), (2, 3, 2.8, (6.6, 4.5))],
)
def test_what_samples_mix_of_squares_that_move_is_told(scale, side, f_number, way_px):
    """For 99 % of the photosites, and less of it where the path crosses the squares along both axes. way_px: in photosites."""
    planes = squares(scale, side)
    planned = plan(moved_shot(planes, f_number, (scale * way_px[0], scale * way_px[1])))
    optics, fine = planned.optics, np.kron(planes, np.ones(2 * [PARTS // scale]))
    places = [[round(PARTS * way * (number + 0.5) / INSTANTS) for way in way_px[::-1]] for number in range(INSTANTS)]
    swept = sum(np.roll(fine, place, (0, 1)) for place in places) / INSTANTS
    per_light, read_e = optics.accuracy.electrons_per_radiance * optics.weights.max(), optics.accuracy.read_noise_e
    truth = through_pupil(swept, optics.psf, BEYOND_PX, PARTS)
    error = per_light * np.abs(moving_light(planned) - truth) / np.sqrt(per_light * truth + read_e**2)
    inner = error[12:-12, 12:-12]  # the truth repeats the scene beyond its border
    assert np.quantile(inner, 0.99) < planned.error_budget.predicted_sigma < 40.0 * np.quantile(inner, 0.99)


def test_squares_that_are_not_seen_to_move_are_those_at_rest():
    shot = moved_shot(squares(2, 3), 2.8, (1e-5, 0.0))
    assert plan(shot).optics.motion is None
    still = simulate(dataclasses.replace(shot, motion=None))
    assert np.array_equal(simulate(shot).mean_electrons, still.mean_electrons)
