"""Places of a moving image against rays that are followed through space, with SciPy's rotations."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.object_motion import LayerMotion, LayerMoves, Speed
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.optics.geometry.projection import Projection

PROJECTION = Projection(0.7, 10.0, 5.0, 800, 600, 1, False)
GEOMETRY = ImageGeometry(900.0, 640, 480, 0.7, 400.0, 310.0)
PLACES = np.random.default_rng(1).uniform([-320.0, -240.0], [320.0, 240.0], (50, 2))
CAMERA = SteadyMotion(2.0, -3.0, 5.0, 0.04, -0.03, 0.1)
TIMES_S = np.array([0.0, 0.3, 1.1])


LAYER = LayerMotion((Speed(0.2, "m/s"), Speed(-0.1, "m/s")), 20.0, (100.0, 50.0))
SIZE = 600, 800  # of the scene, height and width [px]


def layer_path(times_s: np.ndarray) -> LayerMoves:
    return LAYER.moves(times_s, SIZE)


def places_seen(rotation: Rotation, location_m: np.ndarray, depth_m: float) -> np.ndarray:
    """Places on the plane that photosites see, from the optical axis at rest: rays from the camera, met with the plane."""
    x, y = PLACES.T
    directions = rotation.apply(np.stack([x, -y, np.full_like(x, -900.0)], axis=-1))
    along = (-depth_m - location_m[2]) / directions[:, 2]
    met = location_m + along[:, None] * directions
    return 900.0 / depth_m * np.stack([met[:, 0], -met[:, 1]], axis=-1)


def carried_back(places: np.ndarray, depth_m: float, time_s: float) -> np.ndarray:
    """Places on a layer at rest of places now: its shift in space, then its turn about its centre, undone on the scene."""
    on_scene = GEOMETRY.scale * places + (GEOMETRY.axis_x, GEOMETRY.axis_y)
    on_scene -= GEOMETRY.scale * 900.0 / depth_m * time_s * np.array([0.2, -0.1])
    x, y = (on_scene - (100.0, 50.0)).T
    turned = Rotation.from_euler("z", -20.0 * time_s, degrees=True).apply(np.stack([x, -y, 0.0 * x], axis=-1))
    at_rest = np.stack([turned[:, 0], -turned[:, 1]], axis=-1) + (100.0, 50.0)
    return (at_rest - (GEOMETRY.axis_x, GEOMETRY.axis_y)) / GEOMETRY.scale


@pytest.mark.parametrize("path", [None, layer_path], ids=["still", "moving"])
@pytest.mark.parametrize("depth_m", [0.7, 5.0])
def test_homographies_and_parallax_are_what_rays_meet(path, depth_m):
    motion = ImageMotion(GEOMETRY, (Surface(1.0, 1.0), Surface(depth_m, depth_m, path)), CAMERA)
    numbers, camera = motion.pose_numbers(TIMES_S), CAMERA.poses(TIMES_S)
    homographies = motion.homographies(numbers, 1)
    infinity, shift = motion.parallax(numbers, 1, PLACES)
    for index, time_s in enumerate(TIMES_S):
        rotation = Rotation.from_euler("xyz", camera.rotation_rad[index])
        truth = places_seen(rotation, camera.location_m[index], depth_m)
        if path is not None:
            truth = carried_back(truth, depth_m, time_s)
        found = np.append(PLACES, np.ones((50, 1)), axis=1) @ homographies[index].T
        assert np.abs(found[:, :2] / found[:, 2:] - truth).max() < 1e-9
        assert np.abs(infinity[index] + shift[index] / depth_m - truth).max() < 1e-9


def test_directions_are_those_of_a_camera():
    """A pan to the left and a tilt upwards show what lies left and above; a step to the right shows what lies right."""
    for motion, expected in (
        (SteadyMotion(pan_deg_per_s=1.0), (-900.0 * math.tan(math.radians(1.0)), 0.0)),
        (SteadyMotion(tilt_deg_per_s=1.0), (0.0, -900.0 * math.tan(math.radians(1.0)))),
        (SteadyMotion(right_m_per_s=0.1), (30.0, 0.0)),
        (SteadyMotion(up_m_per_s=0.1), (0.0, -30.0)),
    ):
        moving = ImageMotion(GEOMETRY, (Surface(3.0, 3.0),), motion)
        middle = moving.homographies(moving.pose_numbers(np.ones(1)), 0)[0, :2, 2]
        assert np.allclose(middle, expected, atol=1e-9)


def test_a_camera_at_rest_sees_what_is_there():
    motion = ImageMotion(GEOMETRY, (Surface(2.0, math.inf),))
    assert np.array_equal(motion.homographies(motion.pose_numbers(TIMES_S), 0), np.broadcast_to(np.eye(3), (3, 3, 3)))


def test_a_camera_that_turns_away_or_walks_through_is_told():
    for camera, time_s in ((SteadyMotion(pan_deg_per_s=90.0), 1.0), (SteadyMotion(back_m_per_s=-1.0), 2.5)):
        motion = ImageMotion(GEOMETRY, (Surface(2.0, 2.0),), camera)
        with pytest.raises(PhotositeError, match="motion: a part of the sensor looks past the scene"):
            motion.homographies(motion.pose_numbers(np.array([time_s])), 0)


def test_pixels_that_drift_lie_apart_from_where_the_camera_sees_them():
    """What a photosite sees at rest lies back along the drift, by its speed times the clock, on top of the camera's turn."""
    camera, drifts = SteadyMotion(pan_deg_per_s=2.0), np.array([[30.0, -10.0], [0.0, 5.0]])
    geometry, surface, times_s = ImageGeometry(500.0, 60, 40), Surface(3.0, 3.0), np.array([-0.5, 0.0, 2.0])
    alone, moved = ImageMotion(geometry, (surface,), camera), ImageMotion(geometry, (surface,), camera, drifts)
    views = alone.displacements(alone.pose_numbers(times_s))
    found = moved.displacements(moved.pose_numbers(times_s)).reshape(3, 18, 2, 2)
    expected = views[:, :, None] - times_s[:, None, None, None] * drifts
    np.testing.assert_allclose(found, expected, atol=1e-12)
    still = ImageMotion(geometry, (surface,), None, drifts)
    np.testing.assert_allclose(still.displacements(still.pose_numbers(times_s)), -times_s[:, None, None] * drifts, atol=1e-12)
