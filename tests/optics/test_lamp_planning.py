"""Lamps out of focus in scenes whose pixels no samples divide, or that have few, drawn one by one, against float64."""

import dataclasses
import itertools

import numpy as np
import pytest
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_frame import LENS

from simulator.optics.defocus.lamp_images import square_image
from simulator.optics.pupil.pupil import Aperture
from simulator.pipeline.planner import plan
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera_sections import Window

SHAPE, WIDE = (24, 32), (60, 80)


def lamp_scene(
    scale: float, lamp: float, shape: tuple[int, int] = SHAPE, patch: float = 1.0, second: float = 0.7
) -> np.ndarray:
    """Two lamps side by side over black, beside a patch of other light."""
    light = np.zeros([round(scale * side) for side in shape], np.float32)
    light[:, : len(light[0]) // 6] = patch
    row, column = len(light) // 2 + 1, 2 * len(light[0]) // 3
    light[row, column : column + 2] = lamp, second * lamp
    return light


def means_of(light: np.ndarray, shape: tuple[int, int], radius_px: float, fill_factor: float = 1.0) -> np.ndarray:
    """Truth of `lamp_scene`: its lamps in closed form, the rest by few chords. The scene goes on as it ends."""
    beyond, scale = 16, light.shape[1] / shape[1]
    rest = np.where(light > 1.0, 0.0, light).astype(np.float64)
    wide = np.pad(rest, round(beyond * scale), mode="edge")
    found = photosite_means(wide, tuple(side + 2 * beyond for side in shape), radius_px, fill_factor, chords=64)
    found = found[beyond:-beyond, beyond:-beyond]
    for row, column in np.argwhere(light > 1.0):
        away = [np.arange(count) + 0.5 - (place + 0.5) / scale for count, place in zip(shape, (row, column), strict=True)]
        found = found + light[row, column] * square_image(radius_px, 1.0 / scale, fill_factor**0.5, *away)
    return found


@pytest.mark.parametrize(
    ("radius_px", "scale", "fill_factor", "shape"),
    [
        (0.02, 3.0, 1.0, (8, 8)),
        (0.3, 2.5, 0.6, (8, 12)),
        (1.7, 1.25, 1.0, (8, 12)),
        (3.3, 2.5, 0.5, (12, 16)),
        (4.0, 0.8, 1.0, (15, 20)),
    ],
)
def test_the_image_of_a_square_is_that_of_chords(radius_px, scale, fill_factor, shape):
    light = np.zeros([round(scale * side) for side in shape])
    row, column = len(light) // 2 + 1, len(light[0]) // 2
    light[row, column] = 1.0
    truth = photosite_means(light, shape, radius_px, fill_factor, chords=1024)
    away = [np.arange(count) + 0.5 - (place + 0.5) / scale for count, place in zip(shape, (row, column), strict=True)]
    found = square_image(radius_px, 1.0 / scale, fill_factor**0.5, *away)
    assert np.abs(found - truth).max() < 3e-5 * truth.max()
    assert fill_factor < 1.0 or found.sum() == pytest.approx(scale**-2, rel=1e-12)


@pytest.mark.parametrize(
    ("radius_px", "scale", "open_side"), [(0.02, 0.8, 1.0), (0.7, 0.5, 0.8), (1.7, 0.3, 1.0), (6.2, 0.9, 0.7), (9.0, 0.2, 1.0)]
)
def test_the_image_of_a_tent_is_that_of_chords(radius_px, scale, open_side):
    """Light of a pixel of a coarse scene falls to the middles of those beside it."""
    light, places = np.zeros((9, 9)), np.arange(30) + 0.5
    light[4, 3] = 1.0
    first = 4.2 - 15.0 * scale, 3.9 - 15.0 * scale  # pixels before the first photosite
    truth = photosite_means(light, (30, 30), radius_px, open_side**2, 2048, grid=(scale, *first), is_tent=True)
    away = [places - (pixel + 0.5 - one) / scale for one, pixel in zip(first, (4, 3), strict=True)]
    found = square_image(radius_px, 1.0 / scale, open_side, *away, is_tent=True)
    assert np.abs(found - truth).max() < 3e-5 * truth.max()
    assert open_side < 1.0 or scale < 0.3 or found.sum() == pytest.approx(scale**-2, rel=1e-12)


@pytest.mark.parametrize(
    ("scale", "radius_px", "low_pass_px", "fill_factor", "tolerance"),
    [
        (0.5, 5.0, 0.0, 1.0, 0.1),
        (0.5, 5.0, 0.0, 1.0, 0.0),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((0.8, 2.3, 0.7, 1.0, 0.1), (0.5, 3.0, 1.0, 0.6, 0.0))),
    ],
)
def test_lamps_of_a_coarse_scene_are_drawn_as_light_between_its_pixels(scale, radius_px, low_pass_px, fill_factor, tolerance):
    """Means over photosites left 500 standard deviations and more where the penumbra ends; rays missed it altogether."""
    electrons, shape = 50.0, (20, 30)
    light = lamp_scene(scale, 1e6, shape, patch=0.0)
    shot = fine_shot(light, shape, radius_px, electrons, fill_factor, tolerance)
    camera = dataclasses.replace(shot.camera, low_pass_um=low_pass_px * shot.camera.pixel_pitch_um)
    found, planned = frame_radiance(dataclasses.replace(shot, camera=camera))
    places = itertools.product(*2 * [sorted({-0.5 * low_pass_px, 0.5 * low_pass_px})])
    grids = [(scale, scale * down, scale * across) for down, across in places]
    means = (photosite_means(light, shape, radius_px, fill_factor, 4096, grid=grid, is_tent=True) for grid in grids)
    truth = np.mean(list(means), axis=0)
    z = np.abs(electrons * (found - truth)) / np.sqrt(electrons * truth + 1.0)
    told = next(one.method for one in planned.passes if one.name == "defocus")
    assert planned.optics.lamps is not None and planned.optics.lamps.count == 2 and "2 lamps one by one" in told
    assert z.max() < 0.05 and planned.error_budget.predicted_sigma < 0.05


@pytest.mark.parametrize(
    ("scale", "radius_px", "fill_factor", "shape", "electrons", "lamp"),
    [
        (2.5, 6.5, 1.0, SHAPE, 50.0, 2e5),
        (1.5, 3.0, 0.5, SHAPE, 50.0, 1e5),
        (2.5, 0.7, 1.0, SHAPE, 2000.0, 1e4),  # gathered from the scene's pixels
        (1.25, 0.5, 1.0, (12, 16), 50.0, 1e4),  # so few photosites that lamps are in the quantile of the brightest light
    ],
)
def test_lamps_out_of_focus_keep_the_tolerance(scale, radius_px, fill_factor, shape, electrons, lamp):
    light = lamp_scene(scale, lamp, shape)
    found, planned = frame_radiance(fine_shot(light, shape, radius_px, electrons, fill_factor))
    truth = means_of(light, shape, radius_px, fill_factor)
    z = np.abs(electrons * (found - truth)) / np.sqrt(electrons * truth + 1.0)
    told = planned.error_budget.predicted_sigma
    assert planned.optics.lamps is not None and planned.optics.lamps.count == 2
    assert np.quantile(z, 0.999) <= max(told, 0.1) < 0.5


@pytest.mark.parametrize("scale", [2.0, 4.0])
def test_lamps_in_even_light_keep_the_tolerance_where_samples_divide_pixels(scale):
    """All else is even, so that one sample per photosite has it: its lamps' rims were 91 sigma off, of which 21 were told."""
    light = np.full([round(scale * side) for side in WIDE], 1.0, np.float32)
    row, column = round(scale * (WIDE[0] // 2)), round(scale * (WIDE[1] // 2)) - 1  # in the corner of a photosite
    light[row, column] = 1e6
    found, planned = frame_radiance(fine_shot(light, WIDE, 13.3, 10.0))
    away = [np.arange(count) + 0.5 - (place + 0.5) / scale for count, place in zip(WIDE, (row, column), strict=True)]
    truth = 1.0 + (1e6 - 1.0) * square_image(13.3, 1.0 / scale, 1.0, *away)
    z = np.abs(10.0 * (found - truth)) / np.sqrt(10.0 * truth + 1.0)
    assert z.max() < 0.1 and planned.error_budget.predicted_sigma < 0.1


@pytest.mark.parametrize(
    ("change", "drawn"),
    [
        ({}, True),
        ({"scale": 2.0}, False),  # samples divide pixels
        ({"radius_px": np.linspace(5.0, 6.0, 80)}, False),
        ({"lens": dataclasses.replace(LENS, aperture=Aperture(blades=6))}, False),
        ({"lamp": 3.0}, False),
        ({"tolerance": 0.0}, False),
        ({"scale": 0.5}, True),
        ({"scale": 0.5, "fill_factor": 0.5}, False),  # a kernel comes after the blur
        ({"scale": 0.5, "fill_factor": 0.5, "tolerance": 0.0}, True),
        ({"scale": 0.5, "lens": dataclasses.replace(LENS, diffraction=True)}, False),
    ],
)
def test_lamps_are_drawn_where_no_other_method_is_exact(change, drawn):
    settings = {"scale": 2.5, "radius_px": 5.0, "lamp": 1e4} | change
    light, radius_px = lamp_scene(settings.pop("scale"), settings.pop("lamp")), settings.pop("radius_px")
    if isinstance(radius_px, np.ndarray):
        radius_px = np.broadcast_to(radius_px, light.shape)
    optics = plan(fine_shot(light, SHAPE, radius_px, 50.0, **settings)).optics
    assert (optics.lamps is not None) == drawn


def test_a_few_lamps_are_drawn_however_few_pixels_a_scene_has():
    light = np.zeros((12, 16), np.float32)
    light[[2, 4, 6, 8, 9], [3, 12, 7, 2, 10]] = 1e4
    lamps = plan(fine_shot(light, (24, 32), 3.0, 50.0)).optics.lamps
    assert lamps is not None and lamps.count == 5 > light.size / 64


def test_more_lamps_than_a_64th_of_the_pixels_are_not_drawn():
    light = np.zeros((60, 80), np.float32)
    light[3:-3:3, 20:-3:3] = 1e4
    planned = plan(fine_shot(light, SHAPE, 3.0, 50.0))
    assert planned.optics.lamps is None and planned.error_budget.is_clamped


def test_lamps_out_of_focus_have_the_bits_of_the_frame_in_a_window():
    shot = fine_shot(lamp_scene(2.5, 1e4), SHAPE, 5.0, 50.0)
    whole = simulate(shot).mean_electrons
    assert plan(shot).optics.lamps is not None
    window = dataclasses.replace(shot.camera, window=Window(15, 7, 11, 9))
    assert np.array_equal(simulate(dataclasses.replace(shot, camera=window)).mean_electrons, whole[7:16, 15:26])
