"""Sharp scenes that move while the shutter is open, against sums of very many instants of rays in float64."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.moving_frame import dense_mean, moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

LENS = ThinLens(50.0, 8.0, cos4=False)
WIDTH, HEIGHT, PITCH_UM = 72, 40, 40.0
DISTANCE_PX = 1e3 * LENS.image_distance_mm / PITCH_UM
CAMERA = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
SKEWED = SteadyMotion(tilt_deg_per_s=-20.0, pan_deg_per_s=60.0, roll_deg_per_s=30.0)
ROLLED = SteadyMotion(pan_deg_per_s=30.0, roll_deg_per_s=900.0)
PAN = SteadyMotion(pan_deg_per_s=-math.degrees(800.0 / DISTANCE_PX))  # 800 photosites per second on the axis


def shot_of(scene, camera_motion, **settings) -> Shot:
    motion = settings.pop("motion", Motion(camera=camera_motion))
    camera, lens = settings.pop("camera", CAMERA), settings.pop("lens", LENS)
    return Shot(scene, lens, settings.pop("exposure", Exposure(0.01)), camera, motion=motion, tolerance=0.05, **settings)


def texture(scale: float, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((round(HEIGHT * scale), round(WIDTH * scale)))


@pytest.mark.parametrize("row_s", [0.0, 1e-4])
@pytest.mark.parametrize(
    ("scale", "motion", "by_rows"),
    [(1.0, SKEWED, True), (0.6, SKEWED, True), (1.0, ROLLED, False)],
    ids=["even", "coarse", "roll"],
)
def test_a_moving_camera_gives_the_mean_of_all_it_sees(scale, motion, by_rows, row_s):
    picture = texture(scale)
    planned = plan_moving(shot_of(band_scene(picture, math.inf), motion), rolling(HEIGHT, 0.01, row_s))
    plan_of = planned.optics.motion
    assert plan_of.method == "swept" and planned.optics.sweeps_rows == by_rows
    found = moving_light(planned)
    opens = row_s * np.arange(HEIGHT)
    truth = dense_mean([(picture, None, math.inf)], motion, planned.optics.projection, found.shape, DISTANCE_PX, opens, 0.01)
    assert np.quantile(np.abs(found - truth), 0.99) < 1.2 * plan_of.error + 1e-4
    assert abs(found.mean() - truth.mean()) < 2e-5


@pytest.mark.parametrize(("scale", "roll_deg"), [(1.0, 0.01), (1.0, 0.3), (0.4, 0.3), (1.0, 0.0)], ids=str)
def test_bright_pixels_over_black_keep_what_is_told_where_the_camera_turns_a_little(scale, roll_deg):
    """By the noise of the dark beside them: each photosite reads at its own place, and a pan is no shift to its noise."""
    picture = 10.0 * (np.random.default_rng(3).random((round(20 * scale), round(36 * scale))) < 0.3)
    camera = small_camera(36, 20, pixel_pitch_um=PITCH_UM)
    motion = SteadyMotion(pan_deg_per_s=math.degrees(1.0 / DISTANCE_PX) / 0.01, roll_deg_per_s=roll_deg / 0.01)
    shot = replace(shot_of(band_scene(picture, math.inf), motion, camera=camera), tolerance=0.1)
    planned = plan_moving(shot, rolling(20, 0.01, 1e-4))
    found, opens = moving_light(planned), 1e-4 * np.arange(20)
    projection = planned.optics.projection
    truth = dense_mean([(picture, None, math.inf)], motion, projection, (20, 36), DISTANCE_PX, opens, 0.01, instants=1200)
    electrons = planned.optics.accuracy.electrons_per_radiance * float(planned.optics.weights.max())
    error = electrons * np.abs(found - truth) / np.sqrt(electrons * truth + 1.0)
    assert electrons > 5e3 and planned.optics.sweeps_rows and not planned.optics.sweeps_shift()
    assert np.quantile(error, 0.999) < max(0.1, planned.error_budget.predicted_sigma)


def test_a_fine_scene_is_averaged_over_each_photosite_along_its_path():
    """Two pixels per photosite: each is the mean of 2 x 2 pixels around each place of a horizontal path, exactly."""
    picture = texture(2.0)
    planned = plan_moving(shot_of(band_scene(picture, math.inf), PAN))
    count = planned.optics.motion.count
    found = moving_light(planned)[20]
    sums = np.concatenate([[0.0], np.cumsum(picture[40:42].mean(axis=0))])
    truth = np.zeros(WIDTH)
    x = np.arange(WIDTH) + 0.5 - 0.5 * WIDTH
    for part in (np.arange(4000) + 0.5) / 4000:
        angle = math.radians(-PAN.pan_deg_per_s * 0.01 * part)
        left = 2.0 * (DISTANCE_PX * np.tan(np.arctan(x / DISTANCE_PX) + angle) + 0.5 * WIDTH - 0.5)
        truth += np.interp(left + 2.0, np.arange(len(sums)), sums) - np.interp(left, np.arange(len(sums)), sums)
    middle = slice(10, WIDTH - 20)  # beyond the scene its edge continues
    assert np.abs(found - truth / 8000.0)[middle].max() < 2.0 * planned.optics.motion.error + 5e-4
    assert count > 20


def test_rolling_rows_lean_by_speed_times_row_time():
    """A vertical edge under a pan: the middle of the blurred edge moves by v T_row from row to row, to 0.01 photosite."""
    edge = np.repeat((np.arange(WIDTH) >= 30.0)[None, :], HEIGHT, axis=0).astype(float)
    planned = plan_moving(shot_of(band_scene(edge, math.inf), PAN), rolling(HEIGHT, 0.005, 2e-4))
    middle = WIDTH - moving_light(planned).sum(axis=1)  # where an edge of the same light would stand
    speed = np.diff(middle)
    assert np.abs(speed + 800.0 * 2e-4).max() < 0.01
    assert abs(np.polyfit(np.arange(HEIGHT), middle, 1)[0] + 800.0 * 2e-4) < 0.002


def test_twice_the_time_is_twice_the_length_and_the_light_is_the_same():
    point = np.zeros((HEIGHT, WIDTH))
    point[20, 50] = 1.0
    lengths = []
    for time_s in (0.01, 0.02):
        light = moving_light(plan_moving(shot_of(band_scene(point, math.inf), PAN, exposure=Exposure(time_s))))
        row = light[18:23].sum(axis=0)
        assert light.sum() == pytest.approx(1.0, abs=0.02)
        place = np.arange(WIDTH)
        mean = (row * place).sum() / row.sum()
        assert mean < 50.0  # the camera turns right, so that things move to the left
        lengths.append(math.sqrt(12.0 * (row * (place - mean) ** 2).sum() / row.sum()))
    assert lengths[1] == pytest.approx(2.0 * lengths[0], rel=0.03)


def test_layers_cover_each_other_at_every_instant():
    """A near layer with coverage before a far one, the camera moving sideways: parallax and occlusion, and a spinning layer."""
    rng = np.random.default_rng(5)
    coverage = np.zeros((HEIGHT, WIDTH), np.float32)
    coverage[10:30, 20:45] = 1.0
    near = (rng.random((HEIGHT, WIDTH)) * coverage).astype(np.float32)
    far = rng.random((HEIGHT, WIDTH, 1)).astype(np.float32)
    scene = band_scene(near, 2000.0, coverage=coverage, behind=(Layer(far, 4000.0),)).scene
    motion = SteadyMotion(right_m_per_s=1500.0, pan_deg_per_s=10.0)
    planned = plan_moving(shot_of(scene, motion), rolling(HEIGHT, 0.01, 1e-4))
    assert planned.optics.covering_layers == 2 and not planned.optics.motion.moves_alike
    found, opens = moving_light(planned), 1e-4 * np.arange(HEIGHT)
    pictures = [(near, coverage, 2000.0), (far[..., 0], None, 4000.0)]
    truth = dense_mean(pictures, motion, planned.optics.projection, found.shape, DISTANCE_PX, opens, 0.01)
    assert np.quantile(np.abs(found - truth), 0.99) < 2.0 * planned.optics.motion.error + 1e-4


def test_a_layer_spins_about_its_centre():
    """A bar that turns by 90 deg in the exposure leaves the light of its ring, with its mean kept."""
    side = 40
    bar = np.zeros((side, side), np.float32)
    bar[19:21, 26:34] = 1.0
    scene = band_scene(bar, math.inf, coverage=bar, behind=(Layer(np.zeros((side, side, 1), np.float32)),)).scene
    motion = Motion(layers={0: LayerMotion(None, 9000.0)})
    camera = small_camera(side, side, pixel_pitch_um=PITCH_UM)
    light = moving_light(plan_moving(shot_of(scene, None, motion=motion, camera=camera)))
    assert light.sum() == pytest.approx(bar.sum(), rel=0.01)
    y, x = np.mgrid[:side, :side] + 0.5 - 0.5 * side
    angle = np.degrees(np.arctan2(-y, x))  # counter-clockwise, as it is seen
    inside = (np.hypot(x, y) > 7.0) & (np.hypot(x, y) < 13.0)
    assert light[inside & (angle > 10.0) & (angle < 80.0)].min() > 0.05
    assert light[(angle < -20.0) | (angle > 110.0)].max() == 0.0


@pytest.mark.parametrize("turn_deg", [90.0, 180.0, 270.0, 40.0, 50.0, 130.0, 220.0, 310.0])
def test_a_fine_scene_that_has_turned_round_is_still_seen(turn_deg):
    """Two pixels per photosite, at one instant: quarters show the picture turned, and rings are the same at any angle."""
    side, speed_deg_per_s = 40, 9000.0
    radius = np.hypot(*(np.mgrid[: 2 * side, : 2 * side] + 0.5 - side))
    rough = np.random.default_rng(1).random((2 * side, 2 * side))
    picture = rough if turn_deg % 90.0 == 0.0 else 0.5 + 0.4 * np.cos(radius / 6.0)
    camera, scene = small_camera(side, side, pixel_pitch_um=PITCH_UM), band_scene(picture, math.inf)
    motion = Motion(layers={0: LayerMotion(None, speed_deg_per_s)})
    still = simulate(shot_of(scene, None, camera=camera, motion=Motion(), exposure=Exposure(1e-7))).mean_electrons
    exposure = Exposure(1e-7, start_s=turn_deg / speed_deg_per_s)
    found = simulate(shot_of(scene, None, camera=camera, motion=motion, exposure=exposure)).mean_electrons
    inside = np.hypot(*(np.mgrid[:side, :side] + 0.5 - 0.5 * side)) < 0.4 * side
    np.testing.assert_allclose(found[inside], np.rot90(still, int(turn_deg // 90))[inside], atol=5e-3 * still.max())


@pytest.mark.parametrize("scale", [1.0, 0.6, 2.0])
def test_a_crop_has_the_bits_of_the_frame(scale):
    scene = band_scene(texture(scale)[..., None].repeat(3, axis=2), math.inf)
    camera = small_camera(WIDTH, HEIGHT, cfa="RGGB", pixel_pitch_um=PITCH_UM)
    planned = plan_moving(shot_of(scene, SKEWED, camera=camera), rolling(HEIGHT, 0.01, 1e-4))
    crop = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 40, 21)))
    assert np.array_equal(moving_light(crop), moving_light(planned)[5:26, 17:57])


def test_motion_below_the_tolerance_is_skipped_and_a_still_scene_is_the_same_plan():
    scene = band_scene(0.1 + 0.9 * texture(1.0), math.inf)
    still = plan(replace(shot_of(scene, None), motion=None))
    for motion in (SteadyMotion(), SteadyMotion(pan_deg_per_s=1e-4)):
        planned = plan(shot_of(scene, motion))
        assert planned.optics.motion is None
        assert [one.name for one in planned.passes if one.kept] == [one.name for one in still.passes if one.kept]
    assert "moves by up to" in next(step.why for step in planned.steps if step.stage == "motion blur")


def test_a_path_longer_than_the_frame_smears_all_of_it():
    picture = texture(1.0)
    planned = plan_moving(
        shot_of(
            band_scene(picture, math.inf),
            None,
            motion=Motion(layers={0: LayerMotion((Speed(3e4, "px/s"), Speed(0.0, "px/s")))}),
        )
    )
    light = moving_light(planned)
    assert planned.optics.motion.length.longest_px == pytest.approx(300.0)
    assert np.abs(np.diff(light, axis=1)).max() < 0.01 and np.isfinite(light).all()


def test_depth_that_a_moving_camera_shifts_needs_more_than_a_sweep():
    depth = np.linspace(900.0, 2000.0, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH).astype(np.float32)
    moved = plan(shot_of(band_scene(texture(1.0), depth), SteadyMotion(right_m_per_s=800.0)))
    assert moved.optics.motion.method == "joint"
    turned = plan(shot_of(band_scene(texture(1.0), depth), SKEWED))
    assert turned.optics.motion.method == "swept"


def test_a_coarse_scene_that_is_not_interpolated_has_steps():
    """A step of two pixels, each many photosites wide: its blur is the ramp of the path, and not a staircase."""
    picture = np.array([[1.0, 0.0], [1.0, 0.0]])
    planned = plan_moving(shot_of(band_scene(picture, math.inf, interpolation="nearest"), PAN))
    found = moving_light(planned)[20]
    x = np.arange(WIDTH) + 0.5 - 0.5 * WIDTH
    turned = math.radians(-PAN.pan_deg_per_s * 0.01)  # to the right, so that the edge moves to the left
    truth = np.clip(np.arctan(-x / DISTANCE_PX) / turned, 0.0, 1.0)
    assert np.abs(found - truth).max() < 1.0 / planned.optics.motion.count and planned.optics.motion.count > 20


@pytest.mark.parametrize("speed_deg_per_s", [pytest.param(50.0, marks=pytest.mark.slow), 3000.0], ids=["by rows", "by places"])
def test_what_is_at_rest_behind_a_layer_that_turns_is_read_once(speed_deg_per_s):
    """Two layers at rest, read once through the mean of what passes, are as the same layers in motion that leads nowhere."""
    rng = np.random.default_rng(6)
    cover = np.round(rng.random((3, HEIGHT, WIDTH))).astype(np.float32)
    light = [(own * rng.random((HEIGHT, WIDTH)))[..., None].astype(np.float32) for own in cover[:2]]
    behind = (Layer(light[1], 2100.0, cover[1]), Layer(rng.random((HEIGHT, WIDTH, 1)).astype(np.float32), 2200.0))
    scene = band_scene(light[0][..., 0], 2000.0, coverage=cover[0], behind=behind).scene
    turning, still = LayerMotion(None, speed_deg_per_s), LayerMotion((Speed(1e-9, "px/s"), Speed(0.0, "px/s")))
    plans = [plan_moving(shot_of(scene, None, motion=Motion(layers=moves))) for moves in ({0: turning}, {0: turning, 2: still})]
    assert [one.optics.moving_layers for one in plans] == [1, 3]
    assert plans[0].optics.sweeps_rows == (speed_deg_per_s < 100.0)
    once, each = map(moving_light, plans)
    assert np.abs(once - each).max() < 1e-5 and not plans[0].optics.sweeps_shifted_layers()


def test_a_layer_that_moves_where_it_is_never_seen_leaves_the_picture():
    picture = texture(1.0).astype(np.float32)
    scene = band_scene(picture, 2000.0, behind=(Layer(np.ones((HEIGHT, WIDTH, 1), np.float32), 2100.0),)).scene
    hidden = Motion(layers={1: LayerMotion((Speed(800.0, "px/s"), Speed(0.0, "px/s")))})
    planned = plan_moving(shot_of(scene, None, motion=hidden))
    assert np.abs(moving_light(planned) - picture).max() < 1e-6


@pytest.mark.parametrize("pan_deg", [100.0, 180.0, 800.0])
def test_a_camera_that_turns_away_from_the_scene_is_told(pan_deg):
    """Also where it has turned round by the end, so that the path seems to go back."""
    shot = shot_of(band_scene(texture(1.0), math.inf), SteadyMotion(pan_deg_per_s=pan_deg / 0.01))
    with pytest.raises(PhotositeError, match="motion: a part of the sensor looks past the scene"):
        plan(shot)


@pytest.mark.parametrize("scale", [3, 4, 8])
def test_a_zoom_keeps_all_light_of_a_fine_scene(scale):
    """The camera moves back by a tenth of its distance while the shutter is open; up to 0.5 % of even light was lost."""
    picture = np.ones((scale * 48, scale * 64))
    picture[:, : 6 * scale] = np.random.default_rng(1).random((scale * 48, 6 * scale))
    lens, camera = ThinLens(50.0, 8.0, focus_distance_m=10.0, cos4=False), small_camera(64, 48, pixel_pitch_um=40.0)
    moving = Motion(camera=SteadyMotion(back_m_per_s=100.0))
    planned = plan_moving(Shot(band_scene(picture, 10.0), lens, Exposure(0.01), camera, motion=moving, tolerance=0.1))
    assert planned.optics.motion is not None and planned.optics.motion.method == "swept" and not planned.optics.sweeps_rows
    even = moving_light(planned)[:, 40:60]
    assert even == pytest.approx(even.max(), rel=1e-4)
