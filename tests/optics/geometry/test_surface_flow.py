"""Flow against homographies, rays through space and closed forms."""

import numpy as np
import pytest
from helpers.scene_builders import band_scene
from scipy.spatial.transform import Rotation

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.optics.geometry.surface_flow import SurfaceFlow
from simulator.optics.lens.distortion import Distortion, Warp
from simulator.scene.scene import Layer

FAR_PX, SCALE = 300.0, 2.0
GEOMETRY = ImageGeometry(FAR_PX, 64, 48, SCALE, 80.0, 60.0)  # of a scene of 160 x 120 pixels
SIZE = 120, 160
PLACES = np.random.default_rng(2).uniform([0, 0], [64, 48], (200, 2))
CENTRE = np.array([32.0, 24.0])
CAMERA = SteadyMotion(2.0, -3.0, 20.0, 0.05, -0.03, 0.1)
DOWN = LayerMotion((Speed(0.0, "px/s"), Speed(6.0, "px/s")))


def scene(depth_m=3.0, **settings):
    return band_scene(np.ones(SIZE), depth_m, **settings).scene


def displace(flow, before_s, after_s, axis="all"):
    poses = (flow.poses(axis, np.atleast_1d(times_s)) for times_s in (before_s, after_s))
    return flow.displacements(*poses, PLACES)


def test_a_plane_moves_by_its_homographies():
    layer = LayerMotion((Speed(0.2, "m/s"), Speed(-0.1, "m/s")), 30.0)
    motion = ImageMotion(GEOMETRY, (Surface(3.0, 3.0, lambda times_s: layer.moves(times_s, SIZE)),), CAMERA)
    before, after = motion.homographies(motion.pose_numbers(np.array([0.3, 0.7])), 0)
    places = np.column_stack([PLACES - CENTRE, np.ones(len(PLACES))])
    ends = places @ (np.linalg.inv(after) @ before).T
    expected = ends[:, :2] / ends[:, 2:] + CENTRE - PLACES
    found = displace(SurfaceFlow(scene(), Motion(CAMERA, {0: layer}), GEOMETRY), 0.3, 0.7)
    np.testing.assert_allclose(found, expected, atol=1e-10)
    assert np.abs(found).max() > 3


def test_nothing_moves_on_a_tripod():
    np.testing.assert_allclose(displace(SurfaceFlow(scene(), Motion(), GEOMETRY), 0.3, 0.7), 0.0, atol=1e-13)


def test_a_camera_that_moves_aside_shifts_each_distance_by_parallax():
    """f Delta / Z, of the pixel's own depth where the camera rested before."""
    depth_m = np.where(np.arange(160) < 80, 1.5, np.inf) * np.ones(SIZE)
    found = displace(
        SurfaceFlow(scene(depth_m.astype(np.float32)), Motion(SteadyMotion(right_m_per_s=0.1)), GEOMETRY), 0.0, 0.5
    )
    near = PLACES[:, 0] < 32
    np.testing.assert_allclose(found[near], [[-FAR_PX * 0.05 / 1.5, 0.0]] * near.sum(), atol=1e-10)
    np.testing.assert_allclose(found[~near], 0.0, atol=1e-10)


def test_a_slope_is_followed_through_space():
    """A wall Z = 3 + 0.5 X, met by rays of the first pose in closed form, and seen from the second."""
    x_tangent = (np.arange(160) + 0.5 - 80) / (SCALE * FAR_PX)
    depth_m = (3.0 / (1.0 - 0.5 * x_tangent) * np.ones(SIZE)).astype(np.float32)
    motion = Motion(SteadyMotion(pan_deg_per_s=4.0, right_m_per_s=0.2, back_m_per_s=-0.3))
    first, second = (motion.camera_poses(np.array([time_s])) for time_s in (0.2, 0.9))
    ray = np.column_stack([PLACES - CENTRE, np.full(len(PLACES), FAR_PX)]) * [1, -1, -1]
    ray, eye = Rotation.from_euler("xyz", first.rotation_rad[0]).apply(ray), first.location_m[0]
    # -z = 3 + 0.5 x on the wall; eye + s ray
    share = (3.0 + 0.5 * eye[0] + eye[2]) / (-ray[:, 2] - 0.5 * ray[:, 0])
    point = eye + share[:, None] * ray
    own = Rotation.from_euler("xyz", second.rotation_rad[0]).inv().apply(point - second.location_m[0])
    expected = FAR_PX * own[:, :2] / -own[:, 2:] * [1, -1] + CENTRE - PLACES
    found = displace(SurfaceFlow(scene(depth_m), motion, GEOMETRY), 0.2, 0.9)
    # The depth is that of the nearest pixel, up to half a pixel away: dZ/Z = 0.5 * 0.5 / (SCALE * FAR_PX) of the parallax.
    parallax = np.abs(second.location_m - first.location_m).max() * FAR_PX / 2.5
    np.testing.assert_allclose(found, expected, atol=2 * parallax * 0.25 / (SCALE * FAR_PX))
    assert np.ptp(expected[:, 0]) > 1


def test_the_first_layer_that_covers_more_than_half_is_followed_where_it_is_then():
    coverage = np.zeros(SIZE, np.float32)
    coverage[:, :80] = 1.0
    two = scene(1.0, coverage=coverage, behind=(Layer(np.ones((*SIZE, 1), np.float32), 4.0),))
    motion = Motion(layers={0: LayerMotion((Speed(20.0, "px/s"), Speed(0.0, "px/s"))), 1: DOWN})
    found = displace(SurfaceFlow(two, motion, GEOMETRY), 1.0, 2.0)
    near = PLACES[:, 0] < 32 + 20 / SCALE  # it has moved by 20 scene pixels
    np.testing.assert_allclose(found[near], [[10.0, 0.0]] * near.sum(), atol=1e-10)
    np.testing.assert_allclose(found[~near], [[0.0, 3.0]] * (~near).sum(), atol=1e-10)


def test_under_a_rolling_shutter_a_point_has_the_time_of_the_line_where_it_is_then():
    """A point that sinks by v photosites a second, read T_row a row: it sinks by v T / (1 - v T_row) from frame to frame."""
    row_s, frame_s = 0.05, 0.4
    lines_s = row_s * np.arange(48)
    flow = SurfaceFlow(scene(), Motion(layers={0: DOWN}), GEOMETRY)
    found = displace(flow, lines_s, lines_s + frame_s, "rows")
    inside = (PLACES[:, 1] > 0.5) & (PLACES[:, 1] < 45)
    expected = 3.0 * frame_s / (1.0 - 3.0 * row_s)
    np.testing.assert_allclose(found[inside], [[0.0, expected]] * inside.sum(), atol=1e-8)
    across = displace(flow, 0.05 * np.arange(64), 0.05 * np.arange(64) + frame_s, "columns")
    np.testing.assert_allclose(across, [[0.0, 3.0 * frame_s]] * len(PLACES), atol=1e-10)


def test_through_a_lens_with_distortion_ends_are_distorted():
    warp = Warp(Distortion(k1=-0.1), 40.0, 32.0, 24.0, (1.0,))
    motion = Motion(SteadyMotion(roll_deg_per_s=10.0))
    found = displace(SurfaceFlow(scene(), motion, GEOMETRY, warp), 0.0, 1.0)
    angle = np.radians(10.0)  # the camera turns counter-clockwise, so the picture turns clockwise
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    ideal = np.column_stack(warp.undistorted(*PLACES.T)) - CENTRE
    expected = np.column_stack(warp.distorted(*(ideal @ turn.T + CENTRE).T)) - PLACES
    np.testing.assert_allclose(found, expected, atol=1e-8)
    # About the centre of a round lens a turn is a turn all the same.
    np.testing.assert_allclose(found, (PLACES - CENTRE) @ turn.T + CENTRE - PLACES, atol=1e-8)


def test_vectors_move_the_pixel_that_is_seen():
    velocity = np.zeros((*SIZE, 2), np.float32)
    velocity[:, 60:] = (8.0, -4.0)
    found = displace(SurfaceFlow(scene(), Motion(), GEOMETRY, velocity=velocity), 0.0, 0.5)
    moving = np.floor(PLACES[:, 0] * SCALE + 16) >= 60
    np.testing.assert_allclose(found[moving], [[2.0, -1.0]] * moving.sum(), atol=1e-10)
    np.testing.assert_allclose(found[~moving], 0.0, atol=1e-10)


def test_what_the_camera_has_passed_has_no_place():
    flow = SurfaceFlow(scene(1.0), Motion(SteadyMotion(back_m_per_s=-2.0)), GEOMETRY)
    assert np.isnan(displace(flow, 0.0, 1.0)).all()
    with np.errstate(all="raise"):
        assert np.isfinite(displace(flow, 0.0, 0.4)).all()


@pytest.mark.parametrize("count", [0, 1])
def test_any_number_of_places_is_followed(count):
    flow = SurfaceFlow(scene(), Motion(), GEOMETRY)
    poses = flow.poses("all", np.zeros(1))
    assert flow.displacements(poses, poses, PLACES[:count]).shape == (count, 2)
