"""A photosite is an area: scenes finer than the photosites, sharp and behind small blur circles, against exact means."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.area_truth import fine_scene, photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_error import z_scores
from helpers.lens_frame import LENS
from scipy.special import j1
from scipy.stats import qmc

from simulator.device import open_device
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_rectangles import aperture_rectangles, rectangle_count
from simulator.optics.defocus.lamp_laws import gathered_lamp_error
from simulator.optics.defocus.predicted_error import predicted_error
from simulator.optics.lens.distortion import Distortion
from simulator.optics.passes.scene_gather import rectangles_of_tiles
from simulator.optics.passes.swept_mosaic import lamp_places
from simulator.optics.pupil.pupil import Aperture, Pupil
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.image import ImageScene
from simulator.sensor.camera.camera import Window

SHAPE, MARGIN = (40, 50), 7
PICTURES = Path(__file__).parents[4] / "shared/data/openexr-images"


def worst(pixels, radius, electrons, fill_factor=1.0, shape=SHAPE, **settings) -> float:
    """p99 of |z|, without the margin that sees past the scene."""
    found, _ = frame_radiance(fine_shot(pixels, shape, radius, electrons, fill_factor, **settings))
    truth = photosite_means(pixels, shape, radius, fill_factor, chords=96)
    inner = slice(MARGIN, -MARGIN), slice(MARGIN, -MARGIN)
    return float(np.quantile(np.abs(z_scores(found[inner], truth[inner], electrons)), 0.99))


def test_the_truth_is_the_transform():
    """A wave of square pixels: sinc of pixel, jinc of the disk and sinc of the photosite, and the aliases of the pixels."""
    scale, radius, cycles = 4, 0.9, 0.15
    pixels = 1.0 + 0.5 * np.cos(2.0 * np.pi * cycles * (np.arange(48 * scale) + 0.5) / scale)[None, :].repeat(48 * scale, 0)
    found = photosite_means(pixels, (48, 48), radius, 0.7)
    places, expected = np.arange(48) + 0.5, np.ones(48)
    for order in range(-200, 201):
        q = cycles + scale * order
        angle = 2.0 * np.pi * q * radius
        transfer = 2.0 * j1(angle) / angle * np.sinc(q / scale) * np.sinc(q * math.sqrt(0.7))
        expected += 0.5 * transfer * (-1) ** order * np.cos(2.0 * np.pi * q * places)
    assert np.abs(found[20, 8:-8] - expected[8:-8]).max() < 1e-5


@pytest.mark.parametrize("electrons", [2000.0, 20000.0])
@pytest.mark.parametrize("scale", [2.0, 2.7, 4.0])
@pytest.mark.parametrize("kind", ["noise", "edges"])
def test_fine_scenes_keep_a_tenth_of_the_noise(kind, scale, electrons):
    """Random pixels and edges, at every radius; where pixels do not divide into samples, up to 1 at 20,000 electrons."""
    pixels = fine_scene(kind, scale, SHAPE)
    radii = (0.0, 0.2, 0.3, 0.6, 1.0) + ((2.0, 5.0) if scale != 2.7 or electrons == 2000.0 else ())
    missed = {radius: worst(pixels, radius, electrons) for radius in radii}
    assert max(missed.values()) <= 0.1, missed


@pytest.mark.parametrize(
    ("scale", "radius", "blades"), [(1.02, 0.05, None), (2.0, 0.3, None), (1.02, 1.4, None), (2.0, 1.4, 3)]
)
def test_circles_behind_a_distortion_are_those_of_the_sensor(scale, radius, blades):
    """Random pixels against 2^15 points of photosite and circle, each traced back: upright circles left 6e-3 of the light."""
    shape, aperture = (120, 160), None if blades is None else Aperture(blades, 10.0)
    lens = replace(LENS, aperture=aperture, distortion=Distortion(k1=-0.05, unit="half_diagonal"))
    pixels = fine_scene("noise", scale, shape)
    found, planned = frame_radiance(fine_shot(pixels, shape, radius, 1e5, lens=lens))
    assert not planned.tiles.chosen.sample_grids()
    projection, rng = planned.optics.projection, np.random.default_rng(3)
    right, down, chosen, along = qmc.Sobol(4, seed=1).random_base2(15).T
    lens_x, lens_y = lens.pupil.map_unit_square(chosen, along)
    right, down = right + planned.optics.defocus.radii_px[0] * lens_x, down + planned.optics.defocus.radii_px[0] * lens_y
    rows, columns = rng.integers([MARGIN, MARGIN], [shape[0] - MARGIN, shape[1] - MARGIN], (150, 2)).T
    x, y = projection.warp.undistorted(columns[:, None] + right, rows[:, None] + down)
    places = (projection.offset_y + projection.scale * y).astype(int), (projection.offset_x + projection.scale * x).astype(int)
    truth = pixels[places].mean(axis=1)
    seen = found[rows, columns]
    assert np.abs(seen * truth.sum() / seen.sum() - truth).max() < 2e-3 * pixels.max()


@pytest.mark.parametrize("scale", [2.0, 2.7])
def test_lamps_of_one_pixel_keep_the_noise(scale):
    """Lamps 300 times brighter than their surroundings, whose spots are told from the dark by 300 sigma."""
    pixels = fine_scene("lamps", scale, SHAPE)
    missed = {radius: worst(pixels, radius, 2000.0) for radius in (0.0, 0.2, 0.3, 0.6)}
    assert max(missed.values()) <= 0.1, missed


@pytest.mark.parametrize("scale", [2.0, 2.7])
def test_a_single_lamp_in_the_dark_is_blurred_however_small_its_circle(scale):
    """A search found 1,100 sigma where it was copied: 10^7 e- in one pixel, among too few for a quantile of the light."""
    pixels = np.full([round(scale * side) for side in SHAPE], 0.5)
    pixels[round(20 * scale), round(25 * scale)] = 1e4
    for radius in (1e-5, 0.01, 0.05, 0.3):
        found, planned = frame_radiance(fine_shot(pixels, SHAPE, radius, 1000.0))
        z = z_scores(found, photosite_means(pixels, SHAPE, radius), 1000.0)[MARGIN:-MARGIN, MARGIN:-MARGIN]
        told = planned.error_budget.predicted_sigma
        assert np.abs(z).max() <= max(told, 0.1) and told < 4.0, radius


def test_lamps_that_a_sweep_has_found_are_those_of_tiles_too():
    """Three of them behind blades, of a scene that moves and then rests: each keeps with it what it finds, in its own form."""
    pixels, through = fine_scene("noise", 2.7, SHAPE), replace(LENS, aperture=Aperture(5))
    pixels[[5, 8, 10], [30, 60, 110]] = 1e4
    shot = fine_shot(pixels, SHAPE, 1.0, 1000.0, tolerance=0.3, lens=through)
    shot.scene.load().planes.setflags(write=False)  # else nothing is kept
    planned = measure(plan(shot), open_device())
    assert lamp_places(planned.optics).tolist() == [[30.5, 5.5], [60.5, 8.5], [110.5, 10.5]]
    reached = rectangles_of_tiles(planned.tiles)[:, 0]
    assert reached[0] > reached[1] == reached[2]


@pytest.mark.parametrize("radius", [0.05, 0.15, 0.3])
def test_a_lamp_of_one_pixel_per_photosite_is_told_to_be_unknown_inside_it(radius):
    """Copied, it is right for a point in its middle; for an even square it is off by what the budget tells of the input."""
    pixels = np.full(SHAPE, 0.5)
    pixels[20, 25] = 1e4
    found, planned = frame_radiance(fine_shot(pixels, SHAPE, radius, 1000.0))
    assert planned.optics.defocus is None
    z = z_scores(found, photosite_means(pixels, SHAPE, radius), 1000.0)[MARGIN:-MARGIN, MARGIN:-MARGIN]
    told = planned.error_budget.sigma("input")
    assert 0.5 * told < np.abs(z).max() <= told
    assert any("lamps smaller than photosites" in warning for warning in planned.warnings())


@pytest.mark.parametrize("radius", [0.2, 0.35])
def test_a_lamp_that_is_the_brightest_light_of_a_tiny_frame_is_told_to_be_unknown_inside_it(radius):
    """A search found 3.2 sigma of 100 e- where 1.6 were stated: among 192 pixels one counts as the brightest light."""
    pixels = np.zeros((12, 16))
    pixels[6, 8] = 1.0
    found, planned = frame_radiance(fine_shot(pixels, (12, 16), radius, 100.0))
    assert planned.optics.defocus is None
    told = planned.error_budget.sigma("input")
    assert 0.5 * told < np.abs(z_scores(found, photosite_means(pixels, (12, 16), radius), 100.0)).max() <= told
    pixels[:] = 0.5 + 0.5 * pixels
    assert plan(fine_shot(pixels, (12, 16), radius, 100.0)).error_budget.sigma("input") == 0.0


def test_the_truth_of_the_smallest_circle_is_that_of_none():
    pixels = fine_scene("lamps", 2.7, SHAPE)
    sharp = photosite_means(pixels, SHAPE)
    for radius in (1e-45, 1e-20, 1e-9):
        assert np.abs(photosite_means(pixels, SHAPE, radius) - sharp).max() < 1e-6


@pytest.mark.parametrize("scale", [2.0, 2.7, 4.0])
def test_the_open_area_of_a_photosite_is_integrated(scale):
    """A fill factor of 0.6: less light is no matter here, but finer detail; no point spread function is needed."""
    pixels = fine_scene("noise", scale, SHAPE)
    missed = {radius: worst(pixels, radius, 2000.0, 0.6) for radius in (0.0, 0.2, 0.3, 0.6, 1.0)}
    assert max(missed.values()) <= 0.1, missed
    assert plan(fine_shot(pixels, SHAPE, 0.0, 2000.0, 0.6)).optics.psf is None


def test_a_surface_that_tilts_through_the_focus():
    """Radii from -0.6 to 0.6: each photosite as one of a flat surface of its own radius, 0.003 photosites aside at most."""
    scale = 2.7
    pixels = fine_scene("noise", scale, SHAPE)
    radius = np.linspace(-0.6, 0.6, pixels.shape[1])[None, :].repeat(pixels.shape[0], 0)
    found, planned = frame_radiance(fine_shot(pixels, SHAPE, radius, 2000.0))
    assert 0 in planned.tiles.chosen.samples_per_axis[planned.tiles.chosen.computed]
    for column in (10, 17, 24, 31, 38):
        own = float(np.interp((column + 0.5) * scale, np.arange(pixels.shape[1]) + 0.5, radius[0]))
        truth = photosite_means(pixels, SHAPE, abs(own), chords=96)[MARGIN:-MARGIN, column]
        z = z_scores(found[MARGIN:-MARGIN, column], truth, 2000.0)
        assert np.quantile(np.abs(z), 0.9) < 0.1, (column, own)


def test_a_pupil_with_blades_is_gathered_as_on_a_grid():
    """The sum over rectangles of a pentagon against its exact areas on samples that divide the pixels."""
    shot = fine_shot(fine_scene("noise", 4.0, SHAPE), SHAPE, 0.7, 2000.0, lens=replace(LENS, aperture=Aperture(5, 12.0)))
    device, planned = open_device(), plan(shot)
    optics, defocus, frames = planned.optics, planned.optics.defocus, []
    assert defocus.area.whole_pixels == 4
    for whole_pixels, samples in ((4, 4), (0, 0)):
        accuracy, area = (replace(part, whole_pixels=whole_pixels) for part in (optics.accuracy, defocus.area))
        own = replace(optics, accuracy=accuracy, defocus=replace(defocus, accuracy=accuracy, area=area))
        measured = measure(replace(planned, optics=own), device)
        assert (measured.tiles.chosen.samples_per_axis[measured.tiles.chosen.computed] == samples).all()
        frames.append(device.download(expose(measured, device), SHAPE, np.float32) / optics.weights.sum())
    assert np.quantile(np.abs(z_scores(*frames, 2000.0)), 0.99) < 0.05


def test_rectangles_have_the_moments_of_the_aperture():
    for pupil in (Pupil(), Pupil(5, rotation_deg=12.0)):
        x, y, half_width, half_height, share = aperture_rectangles(pupil, 8).T
        points = pupil.points(1 << 14)
        assert share.sum() == pytest.approx(1.0)
        assert (share @ x, share @ y) == pytest.approx(tuple(points.mean(axis=0)), abs=2e-3)
        variances = share @ (x**2 + half_width**2 / 3.0), share @ (y**2 + half_height**2 / 3.0)
        assert variances == pytest.approx(tuple((points**2).mean(axis=0)), rel=5e-3)
    assert rectangle_count(np.array([0.1, 0.5, 0.6, 1.5])).tolist() == [8, 12, 16, 28]


def overlap(begin, side, half):
    """Share of a pixel from 0 to `side` on a photosite that begins there, mean over shifts by up to half."""

    def ramp(place):
        partly = np.maximum(place + half, 0.0) ** 2 / (4.0 * half) if half > 0.0 else 0.0
        return np.where(np.abs(place) < half, partly, np.maximum(place, 0.0))

    return (ramp(begin + 1.0) - ramp(begin + 1.0 - side) - ramp(begin) + ramp(begin - side)) / side


@pytest.mark.parametrize("side", [0.4, 0.8])
def test_rectangles_end_the_spot_of_a_lamp_within_their_law(side):
    """A pixel at any place, its share on a photosite by rectangles and by chords of the disk, from faint lamps to 10^8 e-."""
    for radius in (0.1, 0.3, 0.5, 1.0, 1.5):
        x, y = np.meshgrid(*[np.linspace(-1.05 - radius, 0.5, 40)] * 2)
        angles = np.pi * ((np.arange(1000) + 0.5) / 1000 - 0.5)
        weights = np.cos(angles) ** 2 / np.sum(np.cos(angles) ** 2)
        exact = sum(
            weight * overlap(x, side, radius * np.cos(angle)) * overlap(y + radius * np.sin(angle), side, 0.0)
            for angle, weight in zip(angles, weights, strict=True)
        )
        for count in int(rectangle_count(np.array(radius))) * np.array([1, 2, 4]):
            parts = aperture_rectangles(Pupil(), count)
            found = sum(
                s * overlap(x + radius * u, side, radius * w) * overlap(y + radius * v, side, radius * h)
                for u, v, w, h, s in parts
            )
            for own_e in (10.0, 1e3, 1e5, 1e8):
                z = own_e * np.abs(found - exact) / np.sqrt(own_e * exact + 1.0)
                lamp = Accuracy(electrons=1000.0, read_noise_e=1.0, peak=own_e / side**2 / 1000.0)
                law = gathered_lamp_error(np.array(radius), count, 1.0 / side, replace(lamp, peak=max(lamp.peak, 4.0)))
                assert z.max() <= lamp.in_sigma(float(law)), (radius, count, own_e)


def test_a_crop_has_the_bits_of_the_frame():
    shot = fine_shot(fine_scene("noise", 2.7, SHAPE), SHAPE, 0.4, 2000.0)
    whole, _ = frame_radiance(shot)
    crop, planned = frame_radiance(replace(shot, camera=replace(shot.camera, window=Window(7, 9, 30, 25))))
    assert planned.tiles.chosen.samples_per_axis.max() == 0
    assert np.array_equal(crop, whole[9:34, 7:37])


def test_tiles_that_a_lamp_reaches_take_more_rectangles_and_no_others():
    """Tiles of 16 rows: a lamp beside a border between two of them reaches both. A crop has the bits of the frame.

    Behind blades, where lamps are not drawn by themselves.
    """
    blades = replace(LENS, aperture=Aperture(8, 12.0))
    for row, expected in ((24.5, [12, 48, 12]), (16.5, [48, 48, 12])):
        pixels = np.full([round(2.7 * side) for side in SHAPE], 0.5)
        pixels[round(2.7 * row), 60] = 1e4
        shot = fine_shot(pixels, SHAPE, 0.4, 1000.0, lens=blades)
        whole, planned = frame_radiance(shot)
        assert rectangles_of_tiles(planned.tiles).ravel().tolist() == expected
        crop, _ = frame_radiance(replace(shot, camera=replace(shot.camera, window=Window(7, 20, 30, 15))))
        assert np.array_equal(crop, whole[20:35, 7:37])
    assert (
        rectangles_of_tiles(measure(plan(fine_shot(0.0 * pixels + 0.5, SHAPE, 0.4, 1000.0)), open_device()).tiles) == 12
    ).all()


def test_a_circle_that_is_left_out_is_told_with_its_error():
    """Smooth light: what is left out is below the tolerance, and said; light between random pixels is never left out."""
    y, x = np.mgrid[: 40 * 2, : 50 * 2]
    smooth = 0.5 + 0.2 * np.cos(2.0 * np.pi * (x + y) / 150.0)
    shot = fine_shot(smooth, SHAPE, 0.02, 2000.0)
    planned, truth = plan(shot), photosite_means(smooth, SHAPE, 0.02)
    assert planned.optics.defocus is None
    told = next(one for one in planned.passes if one.name == "defocus")
    device = open_device()
    found = device.download(expose(planned, device), SHAPE, np.float32) / planned.optics.weights.sum()
    z = np.abs(z_scores(found, truth, 2000.0))[MARGIN:-MARGIN, MARGIN:-MARGIN]
    assert z.max() < told.error_sigma < 0.1 and "without that of radius 0.02" in told.method
    assert plan(fine_shot(fine_scene("noise", 2.0, SHAPE), SHAPE, 0.02, 2000.0)).optics.defocus is not None


@pytest.mark.parametrize(("scale", "fill_factor"), [(2.7, 1.0), (2.7, 0.6), (5.0, 1.0)])
def test_predicted_errors_bound_what_is_found(scale, fill_factor):
    pixels = fine_scene("noise", scale, SHAPE)
    for radius in (0.1, 0.3, 0.6, 1.0, 2.0):
        optics = plan(fine_shot(pixels, SHAPE, radius, 2000.0, fill_factor)).optics
        told = predicted_error(optics.defocus, optics.contrast)
        assert worst(pixels, radius, 2000.0, fill_factor) <= told, radius


@pytest.mark.parametrize("radius", [0.1, 0.2])
def test_distortion_makes_photosites_parallelograms(radius):
    """Against sums over rays in float64: upright squares left 0.2 sigma (the audit's seed 31, shot 34)."""
    scale, electrons, sets = 4.0, 2000.0, 4
    pixels = fine_scene("noise", scale, SHAPE)
    shot = fine_shot(pixels, SHAPE, radius, electrons, lens=replace(LENS, distortion=Distortion(k1=0.15, unit="half_diagonal")))
    found, planned = frame_radiance(shot)
    assert planned.tiles is not None
    assert not planned.tiles.chosen.samples_per_axis[planned.tiles.chosen.computed].any()  # gathered from the scene's pixels
    y, x = (places.ravel()[:, None] for places in np.mgrid[MARGIN : SHAPE[0] - MARGIN : 5, MARGIN : SHAPE[1] - MARGIN : 5])
    means = []
    for seed in range(sets):
        right, down, share, turn = qmc.Sobol(4, seed=seed).random(2**15).T
        reach = radius * np.sqrt(share)
        across, along = x + right + reach * np.cos(2 * np.pi * turn), y + down + reach * np.sin(2 * np.pi * turn)
        warp = planned.optics.projection.warp
        assert warp is not None
        places = warp.undistorted(across, along)
        column, row = (
            np.clip((scale * place).astype(int), 0, size - 1) for place, size in zip(places, pixels.shape[::-1], strict=True)
        )
        means.append(pixels[row, column].mean(axis=1))
    truth, error = np.mean(means, axis=0), np.std(means, axis=0, ddof=1) / math.sqrt(sets)
    told = predicted_error(planned.optics.defocus, planned.optics.contrast)
    z = np.abs(z_scores(found[y[:, 0], x[:, 0]], truth, electrons))
    noise = np.sqrt(truth / electrons)
    unsure = 3.3 * float(np.quantile(error / noise, 0.99))
    assert unsure < 0.15 and z.max() <= told + unsure, (told, unsure)


def turned_frame(shot: Shot, angle_rad: float) -> tuple[np.ndarray, Plan]:
    """Radiance of a frame whose scene is at rest, turned around the sensor's middle from the right downwards."""
    planned, turn = plan(shot), (math.cos(angle_rad) - 1.0, -math.sin(angle_rad), math.sin(angle_rad))
    pose = (0.5 * SHAPE[1], 0.5 * SHAPE[0], 0.0, *turn[:2], 0.0, turn[2], turn[0], 0.0, 0.0)
    extent = abs(math.cos(angle_rad)) + abs(math.sin(angle_rad))
    posed = replace(planned.optics.projection, pose=pose, extent=extent)
    optics = replace(planned.optics, projection=posed).with_moved_pixels()
    measured, device = measure(replace(planned, optics=optics), open_device()), open_device()
    return device.download(expose(measured, device), SHAPE, np.float32) / optics.weights.sum(), measured


def turned_truth(
    pixels: np.ndarray, angle_rad: float, radius: float, pupil: Pupil, fill_factor: float, rows: slice
) -> np.ndarray:
    """The same by rays in float64, of every photosite of some rows and columns."""
    y, x = (places.ravel()[:, None] + 0.5 for places in np.mgrid[rows, rows])
    right, down, chosen, along = qmc.Sobol(4, seed=1).random(2**16).T
    lens_x, lens_y = pupil.map_unit_square(chosen, along)
    side, middle = math.sqrt(fill_factor), (0.5 * SHAPE[1], 0.5 * SHAPE[0])
    across = x + side * (right - 0.5) + radius * lens_x - middle[0]
    below = y + side * (down - 0.5) + radius * lens_y - middle[1]
    turned = across + 1j * below
    turned *= np.exp(1j * angle_rad)
    scale = pixels.shape[0] / SHAPE[0]
    column, row = (
        np.floor(scale * (part + one)).astype(int) for part, one in zip((turned.real, turned.imag), middle, strict=True)
    )
    return pixels[np.clip(row, 0, pixels.shape[0] - 1), np.clip(column, 0, pixels.shape[1] - 1)].mean(axis=1)


@pytest.mark.parametrize("blades", [None, 3])
@pytest.mark.parametrize("angle_deg", [5.0, 12.0, 20.0, 45.0, 130.0])
def test_circles_turn_with_the_photosites_and_keep_their_size(angle_deg, blades):
    """A picture that spins: circles that shrank by the cosine left 0.24 sigma of a promise of 0.1 (audit, 100:45)."""
    pixels, radius, angle, rows = fine_scene("noise", 3.0, SHAPE), 0.3, math.radians(angle_deg), slice(9, 31, 4)
    aperture = None if blades is None else Aperture(blades, 10.0)
    shot = fine_shot(pixels, SHAPE, radius, 2000.0, 0.8, lens=replace(LENS, aperture=aperture))
    found, planned = turned_frame(shot, angle)
    assert not planned.tiles.chosen.samples_per_axis[planned.tiles.chosen.computed].any()  # gathered from the scene's pixels
    truth = turned_truth(pixels, angle, planned.optics.defocus.radii_px[0], shot.lens.pupil, 0.8, rows)
    z = z_scores(found[rows, rows].ravel(), truth, 2000.0)
    assert z.std() < 0.05, z.std()  # of which the truth's is 0.02


def test_black_and_white_squares_that_samples_mix_keep_what_is_told():
    """Sparse lights over black, 2.5 pixels to a photosite: a search found 1.5 times what was told."""
    pixels = 1.0 * (np.random.default_rng(3).random((100, 125)) < 0.02)
    for radius in (1.6, 3.0):
        found, planned = frame_radiance(fine_shot(pixels, SHAPE, radius, 20000.0))
        z = z_scores(found, photosite_means(pixels, SHAPE, radius), 20000.0, 1.0)[MARGIN:-MARGIN, MARGIN:-MARGIN]
        told = planned.error_budget.predicted_sigma
        assert 0.2 * told < np.quantile(np.abs(z), 0.999) < 0.7 * told, radius


@pytest.mark.parametrize("name", ["Desk", "StillLife", "Carrots"])
def test_pictures_of_high_dynamic_range(name):
    """The middle of three pictures at 2.7 pixels per photosite: without blur, and with a radius of a quarter of a photosite."""
    path = PICTURES / f"{name}.exr"
    if not path.is_file():
        pytest.skip(f"{path} is not there: the OpenEXR project's pictures are no part of the repository")
    planes = ImageScene(path, 100.0, negative="clip").load().planes
    top, left = (planes.shape[0] - 270) // 2, (planes.shape[1] - 324) // 2
    pixels = planes[top : top + 270, left : left + 324].mean(axis=2, dtype=np.float64)
    pixels = np.maximum(pixels / np.quantile(pixels, 0.99), 0.0)
    for radius in (0.0, 0.25):
        assert worst(pixels, radius, 2000.0, shape=(100, 120)) <= 0.1, radius
