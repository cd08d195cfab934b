"""Motion before a blur that is the same at each instant: swept once, blurred once, against float64 and the sum of instants."""

from dataclasses import replace

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from helpers.camera_builders import small_camera
from helpers.kernels_alone import without_wings
from helpers.moving_frame import moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.signal import fftconvolve

from simulator.config import load_shot
from simulator.exposure.camera_motion import Poses, SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.instants import instants_error
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.psf_bands import split_into_bands
from simulator.optics.passes.psf_gather import SharpLight
from simulator.optics.passes.swept_light import sweep_light
from simulator.pipeline.error_budget import error_budget
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

WIDTH, HEIGHT, PITCH_UM, TIME_S = 96, 64, 40.0, 0.01
# The brightest light gives some 2000 e-.
BLURRED, SHARP = ThinLens(50.0, 1.4, 2.0, cos4=False, transmittance=4.7e-4), ThinLens(50.0, 8.0, cos4=False)
DIFFRACTED = replace(SHARP, f_number=64.0, diffraction=True)
SWUNG = SteadyMotion(pan_deg_per_s=60.0, tilt_deg_per_s=20.0, roll_deg_per_s=20.0)
WAY_PX = (10.0, 3.25)


def squares(width: int = WIDTH, height: int = HEIGHT) -> np.ndarray:
    coarse = np.random.default_rng(3).random((-(-height // 4), -(-width // 4)))
    return 0.05 + 0.9 * np.kron(coarse, np.ones((4, 4)))[:height, :width]


def shot_of(lens, motion, picture=None, depth_m=5.0, cfa="MONO", tolerance=0.1, **scene) -> Shot:
    picture = squares() if picture is None else picture
    planes = picture if cfa == "MONO" else picture[..., None] * np.array([1.0, 0.7, 0.4])
    camera = small_camera(WIDTH, HEIGHT, cfa=cfa, pixel_pitch_um=PITCH_UM)
    return Shot(band_scene(planes, depth_m, **scene), lens, Exposure(TIME_S), camera, motion=motion, tolerance=tolerance)


def across(way_px: tuple[float, float]) -> Motion:
    """The only layer moves by a way to the right and down in the exposure [scene px]."""
    return Motion(layers={0: LayerMotion((Speed(way_px[0] / TIME_S, "px/s"), Speed(way_px[1] / TIME_S, "px/s")))})


class Swing:
    """A camera that swings to the side by 0.02 m about where it is at rest, 60 times a second."""

    fastest_hz = 60.0

    def poses(self, times_s: np.ndarray) -> Poses:
        location = np.zeros((len(times_s), 3))
        location[:, 0] = 0.02 * np.sin(120.0 * np.pi * times_s)
        return Poses(np.zeros_like(location), location)


def as_instants(planned: Plan, count: int | None = None) -> Plan:
    motion = planned.optics.motion
    summed = replace(motion, method="instants", count=count or motion.count)
    return replace(planned, optics=replace(planned.optics, motion=summed))


def swept_disk(
    radius_px: float, way_px: tuple[float, float], start_px: tuple[float, float] = (0.0, 0.0), steps: int = 256
) -> np.ndarray:
    """Weights of a picture's pixels in a photosite's light: an even disk along a path, read bilinearly, by many rays.

    start_px: where the path begins. steps: of the time, and of either axis of the disk.
    """
    side = (np.arange(steps) + 0.5) / (0.5 * steps) - 1.0
    x, y = (one[np.hypot(*np.meshgrid(side, side)) < 1.0] for one in np.meshgrid(side, side))
    found, middle = np.zeros((81, 81)), 40
    for share in (np.arange(steps) + 0.5) / steps:
        ways = [start + share * way for start, way in zip(start_px, way_px, strict=True)]
        u, v = (middle + radius_px * place - way for place, way in zip((x, y), ways, strict=True))
        column, row = np.floor(u).astype(int), np.floor(v).astype(int)
        for right in (0, 1):
            for down in (0, 1):
                weight = np.abs(1 - right - (u - column)) * np.abs(1 - down - (v - row))
                found += np.bincount((row + down).ravel() * 81 + (column + right).ravel(), weight.ravel(), 81 * 81).reshape(
                    81, 81
                )
    return found / found.sum()


def z_scores(planned: Plan, found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Deviations in units of the noise at the brightest light."""
    return (found - truth) / (0.95 * planned.optics.accuracy.sigma)


def test_a_picture_out_of_focus_that_moves_is_within_the_tolerance_of_float64():
    planned = plan_moving(shot_of(BLURRED, across(WAY_PX)))
    motion, radius = planned.optics.motion, planned.optics.defocus.radii_px[0]
    assert motion.method == "swept_first" and motion.blur.error(motion.path.skew, motion.length.longest_px) == 0.0
    spot = swept_disk(radius, WAY_PX)
    truth = fftconvolve(np.pad(squares(), 40, "edge"), spot[::-1, ::-1], "valid")
    z = z_scores(planned, moving_light(planned), truth)
    assert np.quantile(np.abs(z), 0.999) < 0.1
    still = z_scores(planned, moving_light(plan_moving(shot_of(BLURRED, across((0.5, 0.0))))), truth)
    assert np.quantile(np.abs(still), 0.999) > 3.0  # that the motion is seen at all


@pytest.mark.parametrize("lens", [BLURRED, replace(SHARP, transmittance=0.01)], ids=["defocus", "sharp"])
def test_a_lamp_draws_its_path_evenly_by_its_own_instants(lens):
    """One pixel of 500 times the light around: a streak without dots, and no more instants elsewhere than without it."""
    picture, turning = squares(), replace(across((16.3, 5.6)), camera=SteadyMotion(roll_deg_per_s=10.0))
    without = plan_moving(shot_of(lens, turning, picture)).optics.motion
    picture[32, 30] = 500.0
    planned = plan_moving(shot_of(lens, turning, picture), rolling(HEIGHT, TIME_S, 1e-7))
    motion = planned.optics.motion
    assert motion.lamp_count > 3 * motion.count and motion.count <= 1.1 * without.count
    found = moving_light(planned)
    few, many = (replace(motion, count=count, lamp_count=0) for count in (motion.count, 3 * motion.lamp_count))
    coarse, dense = (moving_light(replace(planned, optics=replace(planned.optics, motion=one))) for one in (few, many))
    noise = planned.optics.accuracy.sigma * np.sqrt(np.maximum(dense / 0.95, 0.1))
    error, without_them = (float((np.abs(light - dense) / noise).max()) for light in (found, coarse))
    assert error < 0.1 and without_them > 0.1
    crop = replace(planned, optics=replace(planned.optics, window=Window(17, 25, 40, 19)))
    assert np.array_equal(moving_light(crop), found[25:44, 17:57])


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize(
    ("lens", "scale"),
    [
        (BLURRED, 1.0),
        (replace(BLURRED, distortion=Distortion(k1=-0.1, unit="half_diagonal")), 0.6),
        pytest.param(DIFFRACTED, 1.0, marks=pytest.mark.slow),
    ],
    ids=["defocus", "distortion", "diffraction"],
)
def test_blur_and_mean_over_time_change_places(lens, scale, cfa):
    """The same instants, each behind the optics and then summed, or summed and then behind the optics once."""
    picture = squares(round(scale * WIDTH), round(scale * HEIGHT))
    planned = plan_moving(shot_of(lens, Motion(camera=SWUNG), picture, cfa=cfa, tolerance=1.0))
    assert planned.optics.motion.method == "swept_first"
    expected = moving_light(as_instants(planned))
    assert np.abs(moving_light(planned) - expected).max() < 2e-3 * expected.max()


def test_a_fine_scene_is_swept_on_samples_of_the_photosites():
    planned = plan_moving(shot_of(BLURRED, Motion(camera=SWUNG), squares(2 * WIDTH, 2 * HEIGHT), tolerance=1.0))
    motion = planned.optics.motion
    assert motion.method == "swept_first" and motion.blur.samples_per_axis in (1, 2, 4)
    z = z_scores(planned, moving_light(planned), moving_light(as_instants(planned, 2 * motion.count)))
    assert np.quantile(np.abs(z), 0.999) < 1.0


@pytest.mark.parametrize("lens", [BLURRED, DIFFRACTED], ids=["defocus", "diffraction"])
def test_lines_at_their_own_times_are_wrong_by_less_than_their_law(lens):
    """Rows that open one after the other, before a spot that their skew would shear."""
    lines = rolling(HEIGHT, TIME_S, 2e-6)
    planned = plan_moving(shot_of(lens, across(WAY_PX), tolerance=0.5), lines)
    motion = planned.optics.motion
    error = motion.blur.skew_error(motion.path.skew, motion.length.longest_px)
    assert motion.method == "swept_first" and motion.blur.followed is None and 0.0 < error
    finer = replace(motion, method="instants", even_count=3 * motion.even_count)  # which all lines share
    truth = moving_light(replace(planned, optics=replace(planned.optics, motion=finer)))
    of_truth = instants_error(finer.even_count, motion.length, motion.blur.contrast)
    assert np.abs(moving_light(planned) - truth).max() < 0.95 * error + of_truth + 1e-4
    swinging = Motion(camera=Swing())
    uneven = plan_moving(shot_of(lens, swinging, tolerance=0.05), rolling(HEIGHT, TIME_S, 1e-3)).optics.motion
    assert uneven.method == "instants" and "swept first it would be wrong by" in uneven.reason


@pytest.mark.parametrize("way_px", [(10.0, 3.25), (-2.0, -7.0)])
@pytest.mark.parametrize(
    ("lens", "row_s"), [(BLURRED, 1e-4), (BLURRED, 4e-4), (DIFFRACTED, 4e-4)], ids=["defocus", "faster", "diffraction"]
)
def test_rows_of_an_even_path_are_seen_through_the_blur_at_their_own_times(lens, row_s, way_px):
    """The light of all rows is swept and blurred once, by spots that are skewed as far as the image moves from row to row.

    That is 0.07 to 0.4 photosites. Upright spots would be wrong by several times as much.
    """
    planned = without_wings(plan_moving(shot_of(lens, across(way_px), tolerance=0.5), rolling(HEIGHT, TIME_S, row_s)))
    motion, rows = planned.optics.motion, [0, 2, 17, 40, 61, 63]
    assert motion.method == "swept_first" and motion.blur.followed is not None
    upright = replace(motion, blur=replace(motion.blur, followed=None))
    padded, truth = np.pad(squares(), 80, "edge"), []
    for row in rows:
        come = row * row_s / TIME_S * np.array(way_px)
        x, y = np.rint(come).astype(int)
        if lens is BLURRED:
            spot = swept_disk(planned.optics.defocus.radii_px[0], way_px, come - (x, y), 64)
        else:
            spot = fftconvolve(
                swept_disk(0.0, way_px, come - (x, y), 64), planned.optics.psf.kernel(0, 0, False, 0, 0)[0], "same"
            )
        around = padded[row + 40 - y : row + 121 - y, 40 - x : WIDTH + 120 - x]
        truth.append(fftconvolve(around, spot[::-1, ::-1], "valid")[0])
    z, without = (
        np.abs(z_scores(planned, moving_light(replace(planned, optics=replace(planned.optics, motion=one)))[rows], truth))
        for one in (motion, upright)
    )
    told = error_budget(planned.optics).predicted_sigma + 0.02  # points of the disk and of time leave 0.02 of the truth
    assert np.quantile(z, 0.999) < told and np.quantile(z, 0.99) < 0.5 * np.quantile(without, 0.99)


@pytest.mark.parametrize("lens", [BLURRED, DIFFRACTED], ids=["defocus", "diffraction"])
def test_a_crop_has_the_bits_of_the_frame_behind_skewed_spots(lens):
    cfa = "RGGB" if lens is BLURRED else "MONO"
    planned = plan_moving(shot_of(lens, across((10.0, 3.25)), cfa=cfa, tolerance=0.5), rolling(HEIGHT, TIME_S, 4e-4))
    assert planned.optics.motion.method == "swept_first" and planned.optics.motion.blur.followed is not None
    crop = replace(planned, optics=replace(planned.optics, window=Window(17, 3, 40, 31)))
    assert np.array_equal(moving_light(crop), moving_light(planned)[3:34, 17:57])


@pytest.mark.parametrize("lens", [BLURRED, DIFFRACTED], ids=["defocus", "diffraction"])
@pytest.mark.parametrize("scale", [0.6, 2.0])
def test_a_crop_has_the_bits_of_the_frame(lens, scale):
    picture = squares(round(scale * WIDTH), round(scale * HEIGHT))
    shot = shot_of(lens, Motion(camera=SWUNG), picture, cfa="RGGB", tolerance=2.0)
    planned = plan_moving(shot, rolling(HEIGHT, TIME_S, 1e-7))
    assert planned.optics.motion.method == "swept_first"
    crop = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 40, 31)))
    assert np.array_equal(moving_light(crop), moving_light(planned)[5:36, 17:57])


def test_layers_that_move_apart_behind_a_point_spread_function_are_swept_before_it():
    """Each instant composited in float64, then behind the lens as a picture at rest; the mean of those."""
    coverage = np.zeros((HEIGHT, WIDTH), np.float32)
    coverage[16:44, 20:50] = 1.0
    near, far = squares()[::-1] * coverage, squares()
    behind = (Layer(far[..., None].astype(np.float32), 4000.0),)
    shot = shot_of(DIFFRACTED, across(WAY_PX), near, 3000.0, coverage=coverage, behind=behind, tolerance=1.0)
    planned = plan_moving(shot)
    motion = planned.optics.motion
    assert motion.method == "swept_first" and not motion.moves_alike
    still = replace(shot, motion=Motion(camera=SteadyMotion()))
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    light = np.zeros((HEIGHT, WIDTH))
    for share in (np.arange(24) + 0.5) / 24:
        seen = y - share * WAY_PX[1], x - share * WAY_PX[0]
        over, alpha = (map_coordinates(one, seen, order=1, mode="nearest") for one in (near, coverage.astype(float)))
        light += (over + (1.0 - alpha) * far) / 24
    truth = moving_light(plan_moving(replace(still, scene=band_scene(light, 4000.0))))
    z = z_scores(planned, moving_light(planned), truth)
    assert np.quantile(np.abs(z), 0.99) < 1.0


def test_the_plan_says_what_is_swept_first_and_why_not():
    from simulator.pipeline.planner import plan

    passes = [one for one in plan(shot_of(BLURRED, across(WAY_PX))).passes if one.kept]
    names = [one.name for one in passes]
    assert names.index("motion") < names.index("defocus")
    assert "before the blur, which is the same at each instant" in passes[names.index("motion")].method
    depth_m = np.linspace(3.0, 6.0, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH).astype(np.float32)
    steep = {one.name: one for one in plan(shot_of(BLURRED, across(WAY_PX), depth_m=depth_m)).passes}
    assert "since swept first it would be wrong by" in steep["motion"].method
    depth_m[:, 40:] = 2.05
    stepped = {one.name: one for one in plan(shot_of(BLURRED, across(WAY_PX), depth_m=depth_m)).passes}
    assert "since the blur radius differs from place to place" in stepped["motion"].method


def tilted(dioptres: float, lens: ThinLens = BLURRED, aside_m_per_s: float = 0.0) -> Plan:
    """A camera pans over a picture that comes from 0.3 dioptres, blur radii of 4.3 photosites, to these from left to right."""
    across_it = np.linspace(0.3, dioptres, WIDTH)[None, :] - 2e-5 * np.arange(HEIGHT)[:, None]
    pan = SteadyMotion(pan_deg_per_s=60.0, tilt_deg_per_s=20.0, right_m_per_s=aside_m_per_s)
    return plan_moving(shot_of(lens, Motion(camera=pan), depth_m=(1.0 / across_it).astype(np.float32)))


@pytest.mark.parametrize("lens", [BLURRED, replace(BLURRED, diffraction=True)], ids=["defocus", "diffraction"])
def test_a_tilted_picture_that_a_camera_pans_over_is_swept_once(lens):
    """Blur radii go along with the picture; those of the middle of the path are nearly the same."""
    planned = tilted(0.29, lens)
    motion = planned.optics.motion
    assert motion.method == "swept_first" and motion.blur.slope > 0.002
    z = z_scores(planned, moving_light(planned), moving_light(as_instants(planned, 2 * motion.count)))
    assert np.quantile(np.abs(z), 0.999) < planned.optics.accuracy.in_sigma(motion.error)
    crop = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 40, 31)))
    assert np.array_equal(moving_light(crop), moving_light(planned)[5:36, 17:57])


def test_radii_of_the_middle_of_a_path_are_wrong_by_less_than_their_law():
    """Six times the tilt that is swept at this tolerance: instants are taken, and the law holds where they are not."""
    planned, slight = tilted(0.2), tilted(0.29)
    motion, law = planned.optics.motion, slight.optics.motion.blur
    assert motion.method == "instants" and "swept first it would be wrong by" in motion.reason
    per_dioptre = np.ptp(planned.optics.defocus.radii_px[0]) / np.ptp(1.0 / planned.optics.scene.depth_m)
    steep = replace(law, slope=float(per_dioptre * np.hypot(0.1 / (WIDTH - 1), 2e-5)))
    swept = replace(planned.optics, motion=replace(motion, method="swept_first", blur=steep))
    error = moving_light(replace(planned, optics=swept)) - moving_light(as_instants(planned, 2 * motion.count))
    assert 0.3 < np.quantile(np.abs(error), 0.999) / steep.tilt_error(motion.length.longest_px) < 1.0


def test_parallax_below_the_tolerance_is_one_path():
    still, slight, large = (tilted(0.29, aside_m_per_s=speed).optics.motion for speed in (0.0, 0.002, 2.0))
    assert (still.method, slight.method, large.method) == ("swept_first", "swept_first", "joint")
    assert still.error < slight.error


def fine_shot(picture: np.ndarray, way_px: tuple[float, float], lens: ThinLens, depth_m: float = 2.01) -> Shot:
    """Shot of even squares, two per photosite and axis, whose circles are smaller than a photosite."""
    return shot_of(lens, across(way_px), picture, depth_m, tolerance=1.0)


def test_lamps_of_a_fine_scene_that_moves_reach_no_photosite_that_they_do_not_pass():
    """Samples of light that is swept first spread a lamp over their area: here half a photosite, over whose border it goes."""
    picture = np.full((2 * HEIGHT, 2 * WIDTH), 1e-6)
    picture[60, 80] = picture[30, 31] = 3000.0
    planned = plan_moving(fine_shot(picture, (4.0, 0.0), replace(BLURRED, f_number=8.0), 1.999))
    radius = abs(planned.optics.defocus.radii_px[0])
    assert 0.0 < radius < 0.05 and planned.optics.motion.method == "instants"
    light = moving_light(planned)
    # A pixel in the upper half of its photosite moves along the row: nothing is seen below it.
    assert light[30].max() > 100.0 and light[31].max() < 1e-3 and light[16].max() < 1e-3


@pytest.mark.parametrize("scale", [1, 2])
def test_frames_of_one_plan_share_the_tiles_of_the_blur(scale, device):
    """They were chosen three times for each: 6 of the 12 ms of processor time of the host."""
    picture = np.kron(squares(WIDTH, HEIGHT), np.ones((scale, scale)))
    optics = plan_moving(shot_of(BLURRED, across((scale * 10.0, scale * 3.25)), picture)).optics
    planes = [camera_planes(device, layer, optics.weights, optics.has_coverage, None) for layer in optics.scene.layers]
    first, second = (sweep_light(optics, device, planes)[1] for _ in range(2))
    assert first is not None and second is not None and first.chosen is second.chosen


def test_kernels_find_the_radii_of_a_swept_picture_on_the_grid_of_its_scene(device, tmp_path):
    """Its light lies on a grid of its own, 160 photosites wide: radii were read on that one, beside the map of 33 x 37."""
    planned = plan(load_shot(draw_shot(6601, 107).write(tmp_path)))
    psf, radius_px = planned.optics.psf, planned.optics.defocus.radii_px[0]
    assert psf is not None and psf.corrected_px and planned.optics.motion.method == "swept_first"
    planes = [camera_planes(device, planned.optics.scene.layers[0], planned.optics.weights, False)]
    optics, tiles, swept = sweep_light(planned.optics, device, planes)
    assert optics.moved_radii is not None and tiles is not None
    band = split_into_bands(optics.window, psf.gather_reach_px, psf.over)[0]
    light = device.empty(band.layout.shape(optics.channels), np.float32)
    radius = device.empty(band.layout.shape(1), np.float32)
    SharpLight(optics, device, swept, tiles, light, radius).fill(band, light)
    found = device.download(radius, band.layout.shape(1), np.float32)
    assert radius_px.min() <= found.min() and found.max() <= radius_px.max()
