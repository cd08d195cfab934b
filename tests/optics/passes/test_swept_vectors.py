"""Sharp pictures whose pixels move by vectors, against layers and against closed forms of the places in float64."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.moving_frame import moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.vector_maps import VectorMap
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window

LENS = ThinLens(50.0, 8.0, cos4=False)
WIDTH, HEIGHT, TIME_S = 72, 40, 0.01
CAMERA = small_camera(WIDTH, HEIGHT, pixel_pitch_um=40.0)
SQUARE = slice(10, 30), slice(20, 40)
X, Y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)


@pytest.fixture
def moved(tmp_path):
    """Makes a shot of a picture and its velocities [px/s, or as stated]."""

    def make(picture, velocity, depth_m=np.inf, unit="px/s", camera=CAMERA, path=None, lens=LENS, tolerance=2.0, **settings):
        np.save(tmp_path / "vectors.npy", np.asarray(velocity, np.float32))
        motion = Motion(path, vectors=VectorMap(tmp_path / "vectors.npy", unit))
        scene = band_scene(picture, depth_m, **settings)
        return Shot(scene, lens, Exposure(TIME_S), camera, motion=motion, tolerance=tolerance)

    return make


def texture(scale: float = 1.0, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((round(HEIGHT * scale), round(WIDTH * scale)))


def uniform(picture: np.ndarray, right: float, down: float) -> np.ndarray:
    return np.broadcast_to([right, down], (*picture.shape, 2))


def read(picture: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return map_coordinates(np.float64(picture), (y - 0.5, x - 0.5), order=1, mode="nearest")


def square_field(speed: float) -> np.ndarray:
    velocity = np.zeros((HEIGHT, WIDTH, 2))
    velocity[SQUARE] = (speed, 0.0)
    return velocity


def square_truth(picture: np.ndarray, speed: float, opens_s: np.ndarray, instants: int = 400) -> np.ndarray:
    """Mean of a square that moves to the right over what stands still, which is unknown where the square was."""
    total = np.zeros((HEIGHT, WIDTH))
    for part in (np.arange(instants) + 0.5) / instants:
        from_x = X - speed * (opens_s[:, None] + part * TIME_S)
        is_front = (from_x >= 20) & (from_x < 40) & (Y > 10) & (Y < 30)
        total += np.where(is_front, read(picture, from_x, Y), read(picture, X, Y)) / instants
    return total


@pytest.mark.parametrize(
    ("scale", "tolerance", "least"),
    [(0.6, 2.0, 2e-5), (2.0, 2.0, 2e-5), (1.0, 1e-3, 5e-4)],  # at one pixel per photosite a layer's path has no instants
)
@pytest.mark.parametrize("unit", ["px/s", "m/s"])
def test_vectors_that_are_all_alike_are_the_motion_of_a_layer(moved, scale, tolerance, least, unit):
    picture, speed = texture(scale), (600.0 * scale, -250.0 * scale)
    if unit == "m/s":  # at 5 m, whose image is one of 50 mm behind the lens
        speed = tuple(one * 5.0 / (1e3 * LENS.image_distance_mm / 40.0 * scale) for one in speed)
    depth_m = 5.0 if unit == "m/s" else np.inf
    lens = replace(LENS, f_number=2000.0, diffraction=False)
    shot = moved(picture, uniform(picture, *speed), depth_m, unit, lens=lens, tolerance=tolerance)
    layer = LayerMotion((Speed(speed[0], unit), Speed(speed[1], unit)))
    single = replace(shot, motion=Motion(layers={0: layer}))
    lines = rolling(HEIGHT, TIME_S, 1e-4)
    planned, expected = plan_moving(shot, lines), plan_moving(single, lines)
    assert planned.optics.motion.vectors is not None and planned.optics.motion.count == expected.optics.motion.count
    np.testing.assert_allclose(moving_light(planned), moving_light(expected), atol=least)


def test_a_field_that_turns_puts_each_pixel_where_it_moved(moved):
    """The place of a linear field has a closed form: q = c + (1 + t W)^-1 (p - c)."""
    picture, centre, turn = texture(), np.array([36.0, 20.0]), np.array([[0.0, -12.0], [12.0, 0.0]])
    velocity = np.stack([X - centre[0], Y - centre[1]], axis=-1) @ turn.T
    planned = plan_moving(moved(picture, velocity, tolerance=0.05))
    found, truth = moving_light(planned), np.zeros((HEIGHT, WIDTH))
    for part in (np.arange(200) + 0.5) / 200:
        back = np.linalg.inv(np.eye(2) + part * TIME_S * turn)
        place = np.stack([X - centre[0], Y - centre[1]], axis=-1) @ back.T + centre
        truth += read(picture, place[..., 0], place[..., 1]) / 200
    inner = slice(6, -6), slice(6, -6)
    assert np.quantile(np.abs(found - truth)[inner], 0.99) < 1.2 * planned.optics.motion.error + 1e-4
    assert abs((found - truth)[inner].mean()) < 2e-4


@pytest.mark.parametrize("row_s", [0.0, 1e-4])
@pytest.mark.parametrize("has_depth", [False, True], ids=["faster", "nearer"])
def test_a_square_covers_what_it_moves_over(moved, row_s, has_depth):
    picture, speed = texture(), 1500.0
    depth_m = np.full((HEIGHT, WIDTH), 4e6, np.float32)
    depth_m[SQUARE] = 2e6
    planned = plan_moving(moved(picture, square_field(speed), depth_m if has_depth else np.inf), rolling(HEIGHT, TIME_S, row_s))
    found, truth = moving_light(planned), square_truth(picture, speed, row_s * np.arange(HEIGHT))
    is_known = (X < 20) | (X > 40) | (Y < 9) | (Y > 31)
    assert np.abs(found - truth)[is_known].max() < 1.2 * planned.optics.motion.error + 1e-4
    assert np.abs(found - truth)[(X < 20) | (Y < 10) | (Y > 30)].max() < 1e-5  # nothing passes there
    assert found.min() >= picture.min() - 1e-6 and found.max() <= picture.max() + 1e-6


def test_what_a_square_leaves_is_the_surface_behind(moved):
    """A bright square before a dark wall leaves the wall's light, and its own covers as much as its area and path say."""
    picture = np.full((HEIGHT, WIDTH), 0.25)
    picture[SQUARE] = 1.0
    found = moving_light(plan_moving(moved(picture, square_field(1500.0), interpolation="nearest")))
    assert found[10:30, 20:22].max() < 0.4  # seen for the first tenth of the exposure alone
    share = np.clip((X - 20.0) / 15.0, 0.0, 1.0) - np.clip((X - 40.0) / 15.0, 0.0, 1.0)
    truth = np.where((Y > 10) & (Y < 30), 0.25 + 0.75 * share, 0.25)
    assert np.abs(found - truth).max() < 0.04
    assert found.sum() == pytest.approx(truth.sum(), rel=2e-3)


def test_a_still_thing_that_is_nearer_covers_what_moves_behind_it(moved):
    """A camera that follows a square: the wall moves, and the square that stands still is before it by depth."""
    picture, velocity = texture(), uniform(texture(), 1500.0, 0.0).copy()
    velocity[SQUARE] = 0.0
    depth_m = np.full((HEIGHT, WIDTH), 4e6, np.float32)
    depth_m[SQUARE] = 2e6
    found = moving_light(plan_moving(moved(picture, velocity, depth_m)))
    inside = slice(11, 29), slice(21, 39)
    np.testing.assert_allclose(found[inside], picture[inside], atol=1e-5)
    swept = moving_light(plan_moving(moved(picture, velocity)))
    assert np.abs(swept - picture)[inside].max() > 0.1  # without depth the faster one covers it


@pytest.mark.parametrize("deviation", [400.0, 1000.0])
def test_even_light_stays_even_wherever_no_search_reaches_a_brighter_pixel(moved, deviation):
    """Pixels that all tear apart, and a bright one that stands still: searches lead as far as velocities do."""
    picture = np.full((HEIGHT, WIDTH), 0.5)
    picture[3, 12] = 1.0
    velocity = np.random.default_rng(3).normal(0.0, deviation, (HEIGHT, WIDTH, 2))
    velocity[:8, :30] = 0.0
    planned = plan_moving(moved(picture, velocity))
    assert planned.optics.motion is not None  # one pixel of 2880 shows that all moves
    found = moving_light(planned)
    is_far = np.hypot(X - 12.5, Y - 3.5) > np.hypot(velocity[..., 0], velocity[..., 1]).max() * TIME_S + 2.0
    assert is_far.sum() > 300
    np.testing.assert_allclose(found[is_far], 0.5, rtol=2e-6)
    assert found.min() > 0.5 - 1e-6 and found.max() < 1.0 + 1e-6
    assert np.abs(found - picture).max() > 1e-3  # elsewhere places that no pixel comes to show it


def test_a_camera_that_turns_is_added_to_vectors(moved):
    """A pan that follows all pixels leaves the picture nearly as it is: both ways cancel on the axis."""
    picture = texture()
    pan_deg_per_s = -np.degrees(800.0 / (1e3 * LENS.image_distance_mm / 40.0))  # things move to the right by 800 px/s
    shot = moved(picture, uniform(picture, -800.0, 0.0), path=SteadyMotion(pan_deg_per_s=-pan_deg_per_s))
    found = moving_light(plan_moving(shot))
    np.testing.assert_allclose(found[16:24, 32:40], picture[16:24, 32:40], atol=0.01)


def test_a_crop_has_the_bits_of_the_frame(moved):
    camera = small_camera(WIDTH, HEIGHT, cfa="RGGB", pixel_pitch_um=40.0)
    picture = texture()[..., None].repeat(3, axis=2)
    planned = plan_moving(moved(picture, square_field(1500.0), camera=camera), rolling(HEIGHT, TIME_S, 1e-4))
    crop = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 40, 21)))
    assert np.array_equal(moving_light(crop), moving_light(planned)[5:26, 17:57])


def test_no_motion_is_skipped_and_much_of_it_smears_the_frame(moved):
    picture = texture()
    still = plan(moved(picture, square_field(0.0)))
    assert still.optics.motion is None
    assert next(step.why for step in still.steps if step.stage == "motion blur") == "nothing moves"
    planned = plan_moving(moved(picture, uniform(picture, 3e4, 0.0)))
    light = moving_light(planned)
    assert planned.optics.motion.length.longest_px == pytest.approx(300.0)
    assert np.abs(np.diff(light, axis=1)).max() < 0.01 and np.isfinite(light).all()
    gone = moving_light(plan_moving(moved(picture, uniform(picture, 1e30, 0.0))))  # what is at the left edge continues
    np.testing.assert_allclose(gone, np.repeat(picture[:, :1], WIDTH, axis=1), rtol=2e-6)


def test_explain_says_what_covers_what(moved):
    planned = plan(moved(texture(), square_field(1500.0)))
    assert "the faster covers the slower" in next(step.why for step in planned.steps if step.stage == "motion blur")
    assert "velocity of each pixel" in next(one.method for one in planned.passes if one.name == "motion")


@pytest.mark.parametrize(
    ("lens", "depth_m"), [(LENS, 2.0), (replace(LENS, f_number=64.0, diffraction=True), np.inf)], ids=["defocus", "diffraction"]
)
def test_behind_a_blur_pixels_of_one_velocity_move_as_a_layer_does(moved, lens, depth_m):
    """The light of all colours is swept before the blur."""
    picture = texture()[..., None] * np.array([1.0, 0.7, 0.4])
    camera = small_camera(WIDTH, HEIGHT, cfa="RGGB", pixel_pitch_um=40.0)
    shot = moved(picture, uniform(picture[..., 0], 1500.0, 400.0), depth_m, camera=camera, lens=lens)
    planned = plan_moving(shot)
    assert planned.optics.motion.method == "swept_first" and planned.optics.motion.vectors is not None
    layer = replace(shot, motion=Motion(layers={0: LayerMotion((Speed(1500.0, "px/s"), Speed(400.0, "px/s")))}))
    expected, allowed = moving_light(plan_moving(layer)), planned.optics.motion.error
    assert np.quantile(np.abs(moving_light(planned) - expected), 0.99) < 2.0 * allowed + 1e-4
    assert np.abs(expected - moving_light(plan_moving(replace(layer, motion=Motion(camera=SteadyMotion()))))).max() > 0.1


def test_what_no_pass_moves_is_refused(moved):
    picture = texture()
    depth_m = np.linspace(900.0, 2000.0, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH).astype(np.float32)
    with pytest.raises(PhotositeError, match=r"motion.vectors = .*vectors.npy: moves pixels one by one, which no pass"):
        plan(moved(picture, square_field(1500.0), 0.004 * depth_m))
    with pytest.raises(PhotositeError, match=r"vectors.npy: moves pixels of a picture with a depth map"):
        plan(moved(picture, square_field(1500.0), depth_m, path=SteadyMotion(right_m_per_s=800.0)))
    with pytest.raises(PhotositeError, match=r"motion.vectors.unit = m/s: is in metres, but the scene has no distance"):
        plan(moved(picture, square_field(1500.0), unit="m/s"))
