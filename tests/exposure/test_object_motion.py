"""A layer moves as stated: in pixels or metres, per second or per frame, turning about a place, along a table."""

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.exposure.object_motion import LayerMotion, Speed

SIZE = 40, 60  # height, width
TIMES_S = np.array([-0.5, 0.0, 0.25, 2.0])


def moved(moves, place):
    """Places (instants, 2) of a point that is at `place` when the layer is at rest."""
    return (moves.matrices @ np.array([*place, 1.0]))[:, :2]


def speeds(right, down, unit):
    return Speed(right, unit), Speed(down, unit)


def test_a_velocity_in_pixels_shifts_all_points_alike():
    moves = LayerMotion(speeds(120.0, -8.0, "px/s")).moves(TIMES_S, SIZE)
    np.testing.assert_allclose(moved(moves, (3.0, 4.0)), [3.0, 4.0] + np.outer(TIMES_S, [120.0, -8.0]), rtol=1e-15)
    assert not moves.shift_m.any()


def test_a_velocity_per_frame_is_that_over_the_frame_time():
    per_frame = LayerMotion(speeds(5.0, 2.0, "px/frame")).moves(TIMES_S, SIZE, frame_time_s=1 / 24)
    per_second = LayerMotion(speeds(120.0, 48.0, "px/s")).moves(TIMES_S, SIZE)
    np.testing.assert_allclose(per_frame.matrices, per_second.matrices, rtol=1e-15)


def test_a_spin_turns_counter_clockwise_about_the_middle_or_a_place():
    quarter = LayerMotion(spin_deg_per_s=90.0).moves(np.ones(1), SIZE)
    np.testing.assert_allclose(moved(quarter, (40.0, 20.0)), [[30.0, 10.0]], atol=1e-12)  # right of the middle, then above it
    about = LayerMotion(spin_deg_per_s=90.0, centre_px=(3.0, 4.0)).moves(np.ones(1), SIZE)
    np.testing.assert_allclose(moved(about, (3.0, 4.0)), [[3.0, 4.0]], atol=1e-12)
    np.testing.assert_allclose(moved(about, (3.0, 2.0)), [[1.0, 4.0]], atol=1e-12)  # above it, then left of it


def test_a_layer_that_spins_and_moves_takes_its_centre_along():
    motion = LayerMotion(speeds(10.0, 20.0, "px/s"), spin_deg_per_s=7200.0, centre_px=(5.0, 6.0))
    np.testing.assert_allclose(
        moved(motion.moves(TIMES_S, SIZE), (5.0, 6.0)), [5.0, 6.0] + np.outer(TIMES_S, [10, 20]), atol=1e-9
    )


def test_metres_move_a_surface_by_focal_length_over_distance():
    """Against points of the scene that are projected in double precision."""
    focal_px, depth_m, velocity = 800.0, 2.5, np.array([1.5, -0.2])
    moves = LayerMotion(speeds(*velocity, "m/s")).moves(TIMES_S, SIZE)
    middle, place = np.array([30.0, 20.0]), np.array([41.0, 3.0])
    across_m = (place - middle) * depth_m / focal_px + np.outer(TIMES_S, velocity)
    at = moved(moves, place) + focal_px / depth_m * moves.shift_m
    np.testing.assert_allclose(at, middle + focal_px * across_m / depth_m, rtol=1e-14)


def test_a_table_adds_its_way_and_turn(tmp_path):
    (tmp_path / "way.csv").write_text("time_s,x_px,y_m,rotation_deg\n0,0,0,0\n1,10,0.5,45\n2,20,1,90\n")
    motion = LayerMotion(speeds(0.0, 4.0, "px/s"), centre_px=(0.0, 0.0), path=tmp_path / "way.csv")
    times_s = np.array([0.0, 2.0])
    moves = motion.moves(times_s, SIZE)
    np.testing.assert_allclose(moved(moves, (7.0, 0.0)), [[7.0, 0.0], [20.0, 8.0 - 7.0]], atol=1e-12)
    np.testing.assert_allclose(moves.shift_m, [[0.0, 0.0], [0.0, 1.0]], atol=1e-15)


def test_a_table_that_ends_too_soon_is_named(tmp_path):
    (tmp_path / "way.csv").write_text("time_s,x_px\n0,0\n1,10\n")
    with pytest.raises(PhotositeError, match="motion.layers.2.path = .*way.csv: the path holds from 0 s to 1 s .* from 0.5 s"):
        LayerMotion(path=tmp_path / "way.csv").moves(np.array([0.5, 1.5]), SIZE, key="motion.layers.2")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"velocity": speeds(np.inf, 0.0, "px/s")}, "velocity = inf px/s: give a finite speed"),
        (
            {"velocity": (Speed(1.0, "px/s"), Speed(0.0, "m/s"))},
            r"velocity = \[1 px/s, 0 m/s\]: give both in pixels",
        ),
        ({"spin_deg_per_s": np.nan}, "spin = nan deg/s: give a finite speed"),
        ({"centre_px": (np.nan, 0.0)}, "centre = .*give a place on the scene"),
    ],
)
def test_what_is_no_motion_is_refused(settings, message):
    with pytest.raises(PhotositeError, match=f"motion.layers.{message}"):
        LayerMotion(**settings)
