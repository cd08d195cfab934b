"""Laws of lamps that are not drawn by themselves: what samples move beyond a rim, and in which noise it counts."""

import math
from dataclasses import replace

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from audit.float64_truth import sum_rays
from audit.shot_truth import run, z_scores
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_frame import depth_of
from helpers.moving_frame import plan_moving
from helpers.scene_builders import FixedScene
from scipy.signal import fftconvolve

from simulator import load_shot
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.lamp_images import square_image
from simulator.optics.defocus.lamp_laws import mixed_lamp_share, moved_rim_error, rim_share, shadow_share, spot_error
from simulator.optics.defocus.photosite_area import PhotositeArea
from simulator.optics.defocus.predicted_error import error_terms
from simulator.pipeline.planner import Plan, measure, plan
from simulator.scene.scene import Layer


@pytest.mark.parametrize(
    ("scale", "samples"), [(1.25, 1), (4.0, 1), (10.0, 1), (1.5, 2), (1.5, 4), (2.5, 2), (2.5, 4), (3.0, 4)]
)
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
    stated = rim_share(scale, samples, 1e6, Accuracy(), 0.0)
    assert 0.9 * stated < moved <= 1.001 * stated


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("scale", [4.0, 8.0])
@pytest.mark.parametrize("spot_e", [0.1, 3.0, 11.0, 40.0, 1e4])
def test_what_samples_move_beyond_a_slanted_rim_is_bounded(scale, samples, spot_e):
    """A pixel in the corner of a sample and a rim of any slant, in the noise of what is seen there and 1 e- of the read-out."""
    side, width, worst = 1.0 / samples, 1.0 / scale, 0.0
    place = np.linspace(-2.0, 2.0, 2001)

    def lit(widths: np.ndarray) -> np.ndarray:
        """Share of the light of uniform lines of these widths, one after the other, beyond each place."""
        light = np.eye(1, 2001, 1000)[0]
        for wide in widths[widths > 0.01].tolist():
            share = np.clip((wide + 0.002 - np.abs(2.0 * place)) / 0.004, 0.0, 1.0)
            light = fftconvolve(light, share / share.sum(), mode="same")
        return 1.0 - np.cumsum(light)

    for slant in np.radians(np.linspace(0.0, 45.0, 10)):
        across = np.array([np.cos(slant), np.sin(slant)])
        moved = 0.5 * (side - width) * across.sum()
        mixed = lit(np.concatenate([across, side * across]))
        exact = np.interp(place + moved, place, lit(np.concatenate([across, width * across])))
        worst = max(worst, float(((mixed - exact) / np.sqrt(1.0 + spot_e * np.maximum(exact, 0.0))).max()))
    stated = rim_share(scale, samples, spot_e / 2000.0, Accuracy(read_noise_e=1.0), 0.0)
    assert 0.5 * stated < worst <= 1.02 * stated


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 8])
@pytest.mark.parametrize("open_side", [0.7, 0.894, 1.0])
def test_open_areas_that_end_within_samples_see_light_beyond_their_borders(open_side, samples):
    """Light of a slit that ends there, by its samples' own squares."""
    area, parts = PhotositeArea(open_side=open_side), 1000
    place = (np.arange(samples * parts) + 0.5) / (samples * parts) - 0.5
    seen = np.repeat(area.shares(samples), parts) / parts
    beyond = seen[place > 0.5 * open_side].sum()
    assert area.beyond(samples) == pytest.approx(beyond, abs=1.0 / parts)


@pytest.mark.parametrize("samples", [1, 2, 4])
@pytest.mark.parametrize("ratio", [-0.5, 0.0, 0.22, 0.9, 1.0])
def test_light_past_the_edge_of_a_shadow_is_bounded(ratio, samples):
    """Coverage over samples, read between them, where a straight edge hides all of a lamp: at all places among samples."""
    scale, open_side, side, most = 2.6875, 0.894, 1.0 / samples, 0.0
    reach = 0.5 * (abs(1.0 - ratio) * open_side + abs(ratio) / scale)
    for edge in np.linspace(0.0, side, 200, endpoint=False):
        first = -4 * samples
        means = np.clip((edge - side * np.arange(first, -first)) * samples, 0.0, 1.0)  # open before the edge
        middles = side * (np.arange(first, -first) + 0.5)
        most = max(most, float(np.interp(edge + reach, middles, means)))
    law = shadow_share(ratio * 5.0, 5.0, scale, open_side, samples)
    assert most == pytest.approx(law, rel=1e-3)


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


def lamp_behind_a_layer(
    lit: float, radius_px: float, electrons: float, scale: float = 3.0, dark: float = 0.0, fill_factor: float = 1.0
) -> tuple[float, Plan]:
    """Error of 99.9 % of the photosites [sigma] around a lamp, far from a nearer layer and from a patch of light.

    dark: light around the lamp, as a share of the patch's.
    """
    shape = 16, 48
    light = np.full([round(scale * side) for side in shape], dark, np.float32)
    light[:16, :24] = 1.0
    row, column = len(light) // 2, 2 * len(light[0]) // 3
    light[row, column] = dark + lit
    shot = fine_shot(light, shape, radius_px, electrons)
    scene, cover = shot.scene.load(), np.zeros_like(light)
    cover[:, :24] = 1.0
    far = Layer(scene.planes, scene.depth_m, None)
    near = replace(scene, planes=(light * cover)[..., None], depth_m=depth_of(-1.4), coverage=cover, behind=(far,))
    camera = replace(shot.camera, fill_factor=fill_factor)
    shot = replace(shot, scene=FixedScene(near), camera=camera, tolerance=shot.tolerance if dark == 0.0 else 1.0)
    found, planned = frame_radiance(shot)
    away = [np.arange(count) + 0.5 - (place + 0.5) / scale for count, place in zip(shape, (row, column), strict=True)]
    truth = electrons * (dark + lit * square_image(radius_px, 1.0 / scale, math.sqrt(fill_factor), *away))
    z = np.abs(electrons * found - truth) / np.sqrt(truth + 1.0)
    return float(np.quantile(z[:, 20:], 0.999)), planned


def test_a_lamp_in_the_dark_counts_in_its_noise_whatever_else_is_lit():
    """9,400 sigma of 5 10^6 e-, beside a patch of 139 e-."""
    found, planned = lamp_behind_a_layer(3.07e5, 0.665, 139.0)
    assert planned.optics.contrast.around_lamps == 0.0
    assert 1e3 < found <= planned.error_budget.predicted_sigma < 10.0 * found


def test_open_areas_bring_light_of_lamps_beside_their_spots():
    """A lamp of 4 10^6 e- before 20 e-, 2.69 pixels per photosite, which 2 x 2 samples mix, and 0.8 of a photosite open."""
    found, planned = lamp_behind_a_layer(2e5, 5.3, 200.0, 2.6875, 0.1, 0.8)
    assert planned.optics.contrast.around_lamps == pytest.approx(0.1)
    spots = planned.optics.accuracy.in_sigma(spot_error(planned.optics.contrast.lamp, 0.1))
    assert spots < found <= planned.error_budget.predicted_sigma < 10.0 * found


def test_a_lamp_that_is_the_brightest_light_of_a_tiny_frame_is_a_lamp():
    """A pixel per photosite, which leaves unknown where in it the lamp is: 9.7 sigma were found where 1.5 were told."""
    light = np.zeros((12, 16), np.float32)
    light[6, 8:10] = 1.0, 1e-3
    found, planned = frame_radiance(fine_shot(light, light.shape, 1.0, 17203.0))
    truth = 17203.0 * photosite_means(light.astype(float), light.shape, 1.0)
    z = np.abs(17203.0 * found - truth) / np.sqrt(truth + 1.0)
    assert planned.optics.contrast.lamp > 0.1 and z.max() < planned.error_budget.predicted_sigma


def beside(begin: np.ndarray, width: float, samples: int, shift: np.ndarray) -> np.ndarray:
    """Share of pixels' light in the photosite from 0 to 1, along one axis, as points in it read it between samples.

    begin, shift: of pixels of this width, and of a sample. A bilinear read is a triangle, of which points see a mean.
    """
    side, spread, found = 1.0 / samples, np.sqrt(1.0 - 1.0 / samples**2), np.zeros(np.broadcast(begin, shift).shape)

    def up_to(place: np.ndarray) -> np.ndarray:
        clipped = np.clip(place / side, -1.0, 1.0)
        return 0.5 + clipped - 0.5 * clipped * np.abs(clipped)

    first = shift + side * np.floor((begin - shift) / side)
    for number in range(int(np.ceil(width / side)) + 2):
        low = first + number * side
        covered = np.clip(np.minimum(low + side, begin + width) - np.maximum(low, begin), 0.0, None)
        middle = low + 0.5 * side
        read = up_to(0.5 * (1.0 + spread) - middle) - up_to(0.5 * (1.0 - spread) - middle)
        found = found + covered / width * read / spread
    return found


@pytest.mark.parametrize("samples", [2, 4])
@pytest.mark.parametrize("scale", [1.25, 2.0, 2.7, 4.0])
@pytest.mark.parametrize("radius_px", [0.0, 0.1, 1.0])
def test_light_of_lamps_in_samples_that_mix_their_pixels_is_bounded(scale, samples, radius_px):
    """Pixels whose whole circle ends before a photosite's border, at all places among the samples."""
    shift = np.linspace(0.0, 1.0 / samples, 41)[:-1, None, None]
    ends = -np.linspace(0.0, 2.0 / samples, 41)[:, None]
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 101)
    chords = np.cos(angle) ** 2 / (np.cos(angle) ** 2).sum()
    begin = ends - 1.0 / scale - radius_px + radius_px * np.sin(angle)
    found = float((beside(begin, 1.0 / scale, samples, shift) @ chords).max())
    law = mixed_lamp_share(scale, samples, radius_px)
    assert (0.8 if radius_px == 0.0 else 0.15) * law < found <= law


@pytest.mark.slow
def test_lamps_that_turn_among_layers_near_the_focus_count_in_the_dark_beside_them(device, tmp_path):
    """Four lamps, 2.7 pixels per photosite: 7,500 sigma were found where 795 were told. The shot leaves such a blur out."""
    shot = load_shot(draw_shot(98, 88).write(tmp_path))
    planned, sharp = plan_moving(shot), measure(plan(shot), device)
    truth = sum_rays(shot, planned, sets=2, points=64).electrons
    assert np.abs(z_scores(run(sharp, shot, device), truth, sharp)).max() < 2.0 and sharp.optics.defocus is None
    found = np.abs(z_scores(run(planned, shot, device), truth, planned)).max()
    (term,) = [term for term in planned.error_budget.terms if "lamps between" in term.cause]
    assert 5e3 < found < term.sigma
    assert planned.optics.contrast.lamp_px == pytest.approx(0.04299, rel=1e-3)  # of the farther layer, which has them
    assert planned.optics.moving_blur is not None
    even = replace(planned.optics.contrast, lamp_px=math.inf)
    assert not any("lamps between" in one.cause for one in error_terms(planned.optics.moving_blur, even))
