"""Laws of lamps that are not drawn by themselves: what samples move beyond a rim, and in which noise it counts."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_frame import depth_of
from helpers.scene_builders import FixedScene

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.lamp_images import square_image
from simulator.optics.defocus.lamp_laws import moved_rim_error, rim_share
from simulator.pipeline.planner import Plan
from simulator.scene.scene import Layer


@pytest.mark.parametrize(("scale", "samples"), [(1.25, 1), (1.5, 2), (1.5, 4), (2.5, 2), (2.5, 4), (3.0, 4)])
def test_what_samples_move_beyond_a_straight_rim_is_bounded(scale, samples):
    """Light of a pixel that ends at the border of a photosite, at all places among the samples."""
    width, side, moved = 1.0 / scale, 1.0 / samples, 0.0
    for begin in np.linspace(0.0, side, 400, endpoint=False):
        borders = side * np.arange(np.ceil((begin + width) / side) + 1)
        shares = np.diff(np.clip(borders, begin, begin + width)) / width
        ends, end = borders[1:], begin + width
        as_squares = np.maximum(ends - end, 0.0) ** 2 / (2.0 * side)
        as_points = np.maximum(ends - 0.5 * side - end, 0.0)
        moved = max(moved, float(shares @ as_squares), float(shares @ as_points))
    assert 0.9 * min(rim_share(scale, samples), 0.15) < moved <= 1.001 * 2.0 / 27.0 * scale * side**2


@pytest.mark.parametrize(("scale", "samples"), [(1.5, 8), (2.6875, 8), (3.3, 8), (2.6875, 16)])
def test_rims_of_rays_move_with_the_middle_of_what_samples_spread(scale, samples):
    """A pixel at all places among the samples, seen by a photosite that lies behind a straight rim through its middle."""
    width, side, moved = 1.0 / scale, 1.0 / samples, 0.0
    for begin in np.linspace(0.0, side, 400, endpoint=False):
        borders = side * np.arange(np.ceil((begin + width) / side) + 1)
        shares = np.diff(np.clip(borders, begin, begin + width)) / width
        rim, last = begin + 0.5 * width, np.maximum(borders[:-1], begin + 0.5 * width)
        behind = np.maximum(borders[1:] - last, 0.0) * (0.5 * (borders[1:] + last) - rim) / side
        moved = max(moved, abs(float(shares @ behind) - 0.125 * width))
    accuracy = Accuracy(electrons=100.0, read_noise_e=1.0)
    assert moved_rim_error(1.0, accuracy, 1.0, scale, samples) == pytest.approx(0.125 * scale * side**2)
    assert 0.9 * 0.125 * scale * side**2 < moved <= 1.001 * 0.125 * scale * side**2


def test_rays_state_what_they_leave_of_the_rim_of_a_lamp():
    """2.69 pixels per photosite, of which 8 x 8 samples mix those at their borders, against the lamp's exact image."""
    scale, side, radius_px, electrons = 2.6875, 48, 9.3, 1500.0
    light = np.ones([round(scale * side)] * 2, np.float32)
    row, column = 64, 64
    light[row, column] += 40000.0
    found, planned = frame_radiance(replace(fine_shot(light, (side, side), radius_px, electrons), tolerance=0.0))
    away = [np.arange(side) + 0.5 - (place + 0.5) / scale for place in (row, column)]
    truth = electrons * (1.0 + 40000.0 * square_image(radius_px, 1.0 / scale, 1.0, *away))
    left = float(np.quantile(np.abs(electrons * found - truth) / np.sqrt(truth + 1.0), 0.999))
    stated = planned.error_budget.predicted_sigma
    assert 0.3 * stated < left < stated


def lamp_behind_a_layer(lit: float, radius_px: float, electrons: float, scale: float = 3.0) -> tuple[float, Plan]:
    """Error of 99.9 % of the photosites [sigma] around a lamp, far from a nearer layer and from a patch of light."""
    shape = 16, 48
    light = np.zeros([round(scale * side) for side in shape], np.float32)
    light[:16, :24] = 1.0
    row, column = len(light) // 2, 2 * len(light[0]) // 3
    light[row, column] = lit
    shot = fine_shot(light, shape, radius_px, electrons)
    scene, cover = shot.scene.load(), np.zeros_like(light)
    cover[:, :24] = 1.0
    far = Layer(scene.planes, scene.depth_m, None)
    near = replace(scene, planes=(light * cover)[..., None], depth_m=depth_of(-1.4), coverage=cover, behind=(far,))
    found, planned = frame_radiance(replace(shot, scene=FixedScene(near)))
    away = [np.arange(count) + 0.5 - (place + 0.5) / scale for count, place in zip(shape, (row, column), strict=True)]
    truth = electrons * lit * square_image(radius_px, 1.0 / scale, 1.0, *away)
    z = np.abs(electrons * found - truth) / np.sqrt(truth + 1.0)
    return float(np.quantile(z[:, 20:], 0.999)), planned


def test_a_lamp_in_the_dark_counts_in_its_noise_whatever_else_is_lit():
    """9,400 sigma of 5 10^6 e-, beside a patch of 139 e-."""
    found, planned = lamp_behind_a_layer(3.07e5, 0.665, 139.0)
    assert planned.optics.contrast.around_lamps == 0.0
    assert 1e3 < found <= planned.error_budget.predicted_sigma < 10.0 * found


def test_a_lamp_that_is_the_brightest_light_of_a_tiny_frame_is_a_lamp():
    """A pixel per photosite, which leaves unknown where in it the lamp is: 9.7 sigma were found where 1.5 were told."""
    light = np.zeros((12, 16), np.float32)
    light[6, 8:10] = 1.0, 1e-3
    found, planned = frame_radiance(fine_shot(light, light.shape, 1.0, 17203.0))
    truth = 17203.0 * photosite_means(light.astype(float), light.shape, 1.0)
    z = np.abs(17203.0 * found - truth) / np.sqrt(truth + 1.0)
    assert planned.optics.contrast.lamp > 0.1 and z.max() < planned.error_budget.predicted_sigma
