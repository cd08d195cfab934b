"""Recorded paths of the camera: a table in any axes, and the shipped clips of hand-held cameras."""

import csv

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats
from scipy.spatial.transform import Rotation

from simulator.errors import PhotositeError
from simulator.exposure.camera_table import CLIPS, COLUMNS, CameraTable, MeasuredClip

NAMES = sorted(path.stem for path in CLIPS.glob("*.csv"))
STEP_S = 0.01
# Root-mean-square rates about x, y and z [deg/s] of data/hand_shake/README, from differences between samples.
RATES = {"the_closeup": (0.46, 0.22, 0.29), "walk_to_the_store": (3.3, 0.85, 3.0), "bike_on_gravel_2d": (118, 32, 21)}


def true_path(times_s):
    """A path of a camera that looks along world y, as Blender writes it: location [m] and Euler angles [rad]."""
    location = np.stack([7 + np.sin(3 * times_s), -6 + 0.2 * times_s, 5 + np.cos(2 * times_s)], axis=1)
    turns = [0.5 * np.pi + 0.1 * np.sin(4 * times_s), 0.05 * np.cos(3 * times_s), 2.7 + 0.3 * times_s]
    return location, np.stack(turns, axis=1)


def put(tmp_path, times_s, location, angles, name="camera.csv"):
    rows = [[*map(repr, map(float, line))] for line in np.column_stack([times_s, location, angles])]
    text = "\n".join(["# exported", ",".join(("time_s", *COLUMNS)), *map(",".join, rows)])
    (tmp_path / name).write_text(text)
    return tmp_path / name


@pytest.fixture
def table(tmp_path):
    times_s = 1.0 + STEP_S * np.arange(101)
    location, angles = true_path(times_s)
    wrapped = np.mod(angles + np.pi, 2 * np.pi) - np.pi  # the third passes half a turn on the way
    assert np.abs(np.diff(wrapped[:, 2])).max() > 6
    return CameraTable(put(tmp_path, times_s, location, wrapped), start_s=1.234)


def test_poses_are_relative_to_the_camera_at_clock_0_in_its_own_axes(table):
    """Against rotations of SciPy; a cubic spline errs by 5/384 h^4 max |f''''| inside, a little more at its ends."""
    times_s = np.linspace(-0.2, 0.7, 400)
    location, angles = true_path(1.234 + times_s)
    (rest,), (rest_angles,) = true_path(np.array([1.234]))
    start = Rotation.from_euler("xyz", rest_angles).inv()
    poses = table.poses(times_s)
    bound = 3 * STEP_S**4 * 5 / 384 * 81  # 3^4 m s^-4 of the location; angles have at most 0.1 * 4^4
    np.testing.assert_allclose(poses.location_m, start.apply(location - rest), atol=bound)
    truth = (start * Rotation.from_euler("xyz", angles)).as_matrix()
    np.testing.assert_allclose(poses.matrices(), truth, atol=bound)


def test_the_pose_at_clock_0_is_rest(table):
    poses = table.poses(np.zeros(1))
    np.testing.assert_allclose(poses.rotation_rad, 0.0, atol=1e-15)
    np.testing.assert_array_equal(poses.location_m, 0.0)


@pytest.mark.parametrize("make", [lambda table: table, lambda table: MeasuredClip("investigation", seed=4)])
def test_speeds_are_the_derivatives_of_poses(table, make):
    path, times_s, step_s = make(table), np.linspace(0.01, 0.7, 50), 1e-5
    after, before, speeds = path.poses(times_s + step_s), path.poses(times_s - step_s), path.speeds(times_s)
    for kind in ("rotation_rad", "location_m"):
        measured = (getattr(after, kind) - getattr(before, kind)) / (2 * step_s)
        np.testing.assert_allclose(measured, getattr(speeds, kind), atol=1e-6)


def test_units_of_locations_and_angles_are_those_stated(tmp_path):
    times_s = np.arange(5.0)
    angles = np.outer(times_s, [0.0, 0.1, 0.0])
    plain = CameraTable(put(tmp_path, times_s, angles, angles))
    other = CameraTable(put(tmp_path, times_s, 1000 * angles, np.degrees(angles), "mm.csv"), unit="mm", angle="deg")
    for kind in ("rotation_rad", "location_m"):
        np.testing.assert_allclose(
            getattr(plain.poses(times_s), kind), getattr(other.poses(times_s), kind), rtol=1e-12, atol=1e-15
        )
    assert plain.poses(times_s).rotation_rad[4, 1] == pytest.approx(0.4)


def test_columns_that_are_left_out_are_0_and_two_lines_make_a_straight_path(tmp_path):
    (tmp_path / "pan.csv").write_text("time_s,rotation_euler_y\n0,0\n2,1\n")
    poses = CameraTable(tmp_path / "pan.csv", angle="deg").poses(np.array([0.0, 0.5, 2.0]))
    np.testing.assert_allclose(poses.rotation_rad, np.radians([[0, 0, 0], [0, 0.25, 0], [0, 1, 0]]), atol=1e-15)
    np.testing.assert_array_equal(poses.location_m, 0.0)


def test_instants_beyond_the_path_name_file_span_and_need(table):
    message = r"motion.camera.path = .*camera.csv: the path holds from -0.234 s to 0.766 s .* needed from 0.7 s to 0.9 s; give"
    with pytest.raises(PhotositeError, match=message):
        table.poses(np.array([0.9, 0.7]))


def test_a_start_beyond_the_table_is_refused(tmp_path):
    (tmp_path / "pan.csv").write_text("time_s,rotation_euler_y\n0,0\n2,1\n")
    with pytest.raises(PhotositeError, match="motion.camera.start = 3 s: the table .*pan.csv has times from 0 s to 2 s"):
        CameraTable(tmp_path / "pan.csv", start_s=3.0).poses(np.zeros(1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "no such file"),
        ("", "its columns are none; name them time_s and some of location_x"),
        ("time_s\n0\n1\n", "its columns are time_s; name"),
        ("time_s,x\n0,0\n1,1\n", "its columns are time_s, x; name"),
        ("time_s,location_x\n0,0\n", "holds 1 lines; a path needs two"),
        ("time_s,location_x\n0,0\n0,1\n", "time_s does not ascend: 0 s comes after 0 s"),
        ("time_s,location_x\n0,0\n1,nan\n", "line 2 of its numbers is 1,nan; give 2 finite numbers"),
        ("time_s,location_x\n0,0\n1\n", "line 2 of its numbers is 1; give 2"),
        ("time_s,location_x\n0,zero\n1,1\n", "line 1 of its numbers is 0,zero"),
        (b"\xff\xfe\x00", "cannot be read"),
    ],
)
def test_a_table_that_is_none_is_refused_by_name(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(PhotositeError, match=f"motion.camera.path = .*bad.csv: {message}"):
        CameraTable(path).poses(np.zeros(1))


def read_clip(name):
    with open(CLIPS / f"{name}.csv", encoding="utf-8") as lines:
        text = list(lines)
    assert "CC0 1.0" in text[0] and "EatTheFuture" in text[0]
    names, *rows = list(csv.reader(line for line in text if not line.startswith("#")))
    table = dict(zip(names, np.array(rows, float).T, strict=True))
    angles = np.stack([table[f"rotation_euler_{axis}"] for axis in "xyz"], axis=1)
    return table["time_s"], angles


def test_there_are_nine_clips():
    assert len(NAMES) == 9


@pytest.mark.parametrize("name", NAMES)
def test_a_clip_passes_through_its_samples_at_the_stated_speed(name):
    times_s, angles = read_clip(name)
    clip = MeasuredClip(name, seed=1, rms_deg_per_s=2.0, length_s=0.5)
    own = clip.span_s[0] + times_s - times_s[0]
    rates = np.diff(clip.poses(own).rotation_rad, axis=0) / np.diff(times_s)[:, None]
    assert np.degrees(np.sqrt(np.mean(np.sum(rates**2, axis=1)))) == pytest.approx(2.0, rel=1e-9)
    measured = MeasuredClip(name, seed=1, length_s=0.5).poses(own).rotation_rad
    np.testing.assert_allclose(measured - measured[0], angles - angles[0], atol=1e-12)


@pytest.mark.parametrize("name", RATES)
def test_measured_rates_are_those_of_the_data(name):
    times_s, _ = read_clip(name)
    clip = MeasuredClip(name)
    angles = clip.poses(clip.span_s[0] + times_s - times_s[0]).rotation_rad
    rates = np.degrees(np.sqrt(np.mean((np.diff(angles, axis=0) / np.diff(times_s)[:, None]) ** 2, axis=0)))
    np.testing.assert_allclose(rates, RATES[name], rtol=0.03)  # the figures have two digits


def test_the_seed_chooses_any_start_that_leaves_the_length():
    ends_s = np.array([MeasuredClip("the_closeup", seed, length_s=3.0).span_s for seed in range(300)])
    length_s = ends_s[0, 1] - ends_s[0, 0]
    assert ends_s[:, 1].min() >= 3.0
    accept({"starts": stats.kstest(-ends_s[:, 0] / (length_s - 3.0), "uniform").pvalue})


def test_a_clip_can_turn_without_changing_its_place():
    times_s = np.linspace(0, 1, 9)
    still = MeasuredClip("investigation", metres_per_unit=0.0).poses(times_s)
    moved = MeasuredClip("investigation", rms_deg_per_s=4.0).poses(times_s)
    assert not still.location_m.any() and moved.location_m.any()
    ratio = moved.rotation_rad[1:] / still.rotation_rad[1:]
    np.testing.assert_allclose(ratio, ratio[0, 0], rtol=1e-9)


def test_a_clip_is_refused_where_it_ends():
    with pytest.raises(PhotositeError, match="motion.camera.length = 40 s: the clip the_closeup is 18.25 s long"):
        MeasuredClip("the_closeup", length_s=40.0).poses(np.zeros(1))
    with pytest.raises(
        PhotositeError,
        match="motion.camera.clip = handycam_run: the path holds .* to 60 s; the whole clip is 2.6.* no clip is that",
    ):
        MeasuredClip("handycam_run").poses(np.array([0.0, 60.0]))
    with pytest.raises(PhotositeError, match=r"give another, such as the_closeup \(18 s\), with length: 18.2 s"):
        MeasuredClip("handycam_run").poses(np.array([0.0, 18.2]))
    assert MeasuredClip("the_closeup", length_s=18.2).poses(np.array([0.0, 18.2])).rotation_rad.shape == (2, 3)
    with pytest.raises(
        PhotositeError, match=r"the path holds from -0.505947 s .* needed from 0 s to 2.5 s; write length: 2.5 s"
    ):
        MeasuredClip("handycam_run", seed=1).poses(np.array([0.0, 2.5]))
    told = r"holds from -0.505947 s .* needed from -1 s to 0 s; give a later exposure.start, or another seed"
    with pytest.raises(PhotositeError, match=told):
        MeasuredClip("handycam_run", seed=1).poses(np.array([-1.0, 0.0]))
    assert MeasuredClip("handycam_run", seed=1, length_s=2.5).poses(np.array([0.0, 2.5])).rotation_rad.shape == (2, 3)
