"""The camera's pose: Euler angles as Blender has them, and steady speeds from rest at clock 0."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import Poses, SteadyMotion, euler_angles, rotation_matrices

ANGLES = np.random.default_rng(5).uniform(-1.5, 1.5, (50, 3))


def test_euler_angles_make_the_matrices_of_scipy_and_come_back():
    matrices = rotation_matrices(ANGLES)
    np.testing.assert_allclose(matrices, Rotation.from_euler("xyz", ANGLES).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(euler_angles(matrices), ANGLES, atol=1e-14)
    np.testing.assert_array_equal(Poses(ANGLES, ANGLES).matrices(), matrices)


def test_a_camera_that_pans_left_looks_left_and_one_that_tilts_up_looks_up():
    ahead = np.array([0.0, 0.0, -1.0])
    for rotation, axis in (((0.0, 0.1, 0.0), 0), ((0.1, 0.0, 0.0), 1)):
        seen = rotation_matrices(np.array([rotation]))[0] @ ahead
        assert seen[axis] == pytest.approx(-np.sin(0.1) if axis == 0 else np.sin(0.1))


def test_steady_motion_grows_with_time_from_rest_at_clock_0():
    motion = SteadyMotion(tilt_deg_per_s=1.0, pan_deg_per_s=-90.0, roll_deg_per_s=3.0, right_m_per_s=1.5, back_m_per_s=-0.5)
    times_s = np.array([-1.0, 0.0, 1e-6, 3600.0])
    poses, speeds = motion.poses(times_s), motion.speeds(times_s)
    np.testing.assert_allclose(poses.rotation_rad, np.outer(times_s, np.radians([1.0, -90.0, 3.0])), rtol=1e-15)
    np.testing.assert_allclose(poses.location_m, np.outer(times_s, [1.5, 0.0, -0.5]), rtol=1e-15)
    assert speeds.rotation_rad.shape == speeds.location_m.shape == (4, 3)
    assert motion.span_s == (-np.inf, np.inf)


@pytest.mark.parametrize("key", ["tilt_deg_per_s", "back_m_per_s"])
def test_a_speed_that_is_not_finite_is_refused(key):
    with pytest.raises(PhotositeError, match=rf"motion.camera.{key.partition('_')[0]} = nan .*give a finite speed"):
        SteadyMotion(**{key: np.nan})
