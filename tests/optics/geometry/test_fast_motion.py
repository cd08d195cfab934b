"""Motion that is fast for the time of an exposure, against dense sums in float64."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.exposure.camera_table import CameraTable
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot

LENS = ThinLens(50.0, 8.0, cos4=False)
PITCH_UM = 40.0
DISTANCE_PX = 1e3 * LENS.image_distance_mm / PITCH_UM


def plan_moving(motion: Motion, time_s: float) -> Plan:
    picture = np.zeros((16, 96))
    picture[:, 47:49] = 1e-3
    camera = small_camera(96, 16, pixel_pitch_um=PITCH_UM)
    return plan(Shot(band_scene(picture, math.inf), LENS, Exposure(time_s), camera, motion=motion))


def vibrating(folder: Path, hertz: float, swing_px: float, time_s: float) -> Motion:
    """A camera that pans by a sine, twelve lines of a table in each of its periods."""
    times_s = np.arange(int(12 * hertz * (time_s + 0.1))) / (12 * hertz)
    angle_rad = swing_px / DISTANCE_PX * np.sin(2.0 * np.pi * hertz * times_s)
    path = folder / "vibration.csv"
    np.savetxt(path, np.stack([times_s, angle_rad], axis=1), "%.12g", ",", header="time_s,rotation_euler_y", comments="")
    return Motion(camera=CameraTable(path))


@pytest.mark.parametrize(("hertz", "time_s"), [(100.0, 5.0), (60.0, 1.0)])
def test_a_camera_that_vibrates_is_followed(tmp_path, hertz, time_s):
    """Places of an edge that swings by 6 photosites: the share of the time for which it lies to the left of each."""
    motion = plan_moving(vibrating(tmp_path, hertz, 6.0, time_s), time_s).optics.motion
    assert motion is not None and motion.missed_error == 0.0
    assert motion.length.longest_px == pytest.approx(4.0 * 6.0 * hertz * time_s, rel=0.01)
    instants = motion.path.of_shift().instants(32_000)  # enough for the path alone to be wrong
    order = np.argsort(instants.pose_numbers[0, :, 0])
    places, sums = instants.pose_numbers[0, order, 0], np.cumsum(instants.weights[0, order])
    truth_px = 6.0 * np.sin(2.0 * np.pi * (np.arange(10_000) + 0.5) / 10_000)
    edges = np.linspace(-6.5, 6.5, 200)
    dense = np.clip(edges - truth_px[:, None], -0.5, 0.5).mean(axis=0)
    found = np.clip(edges - places[:, None], -0.5, 0.5).T @ np.diff(sums, prepend=0.0)
    assert min(np.abs(found - dense).max(), np.abs(found + dense[::-1]).max()) < 0.01


@pytest.mark.parametrize(
    ("turns_per_s", "time_s", "is_followed"), [(512.0, 1.0, True), (2000.0, 5.0, False), (131072.0, 1.0, False)]
)
def test_a_spin_of_whole_turns_in_each_piece_of_a_path_does_not_stand_still(turns_per_s, time_s, is_followed):
    planned = plan_moving(Motion(layers={0: LayerMotion(spin_deg_per_s=360.0 * turns_per_s)}), time_s)
    motion = planned.optics.motion
    assert motion is not None and motion.path.farthest_px == pytest.approx(2.0 * math.hypot(48.0, 8.0), rel=0.01)
    terms = [term for term in planned.error_budget.terms if "straight pieces" in term.cause]
    assert bool(terms) == (not is_followed) and (is_followed or motion.missed_error > 0.0)
    assert is_followed or (planned.error_budget.predicted_sigma >= terms[0].sigma > 0.1 and planned.warnings())
