"""Numbers beside the picture are those of the lens and the shutter."""

import math

import pytest

from simulator.config import load_shot
from simulator.explore.figures import figures_of
from simulator.pipeline.planner import plan


def figures(*settings):
    shot = load_shot("color_checker", list(settings))
    planned = plan(shot)
    return figures_of(shot, planned, planned.sensor)


def test_gauss_and_depth_of_field_hold_for_the_numbers_that_are_shown():
    lens = figures("lens.focal_length=50 mm", "lens.f_number=f/2", "lens.focus_distance=3 m")["lens"]
    assert 1 / 50.0 == pytest.approx(1 / lens["image_distance_mm"] + 1 / 3000.0, rel=1e-12)
    assert lens["pupil_diameter_mm"] == 25.0
    place = min(range(97), key=lambda i: abs(lens["distances_m"][i] - lens["near_m"]))
    circle = 25.0e3 * lens["image_distance_mm"] * abs(1 / 3000.0 - 1e-3 / lens["distances_m"][place])
    assert lens["blur_diameter_um"][place] == pytest.approx(circle, rel=1e-9)


def test_a_rolling_shutter_opens_line_after_line():
    shutter = figures("exposure.shutter={readout_time: 20 ms}")["shutter"]
    rows = shutter["total_lines"]
    assert shutter["axis"] == "rows" and shutter["lines"][0] == 0 and shutter["lines"][-1] == rows - 1
    assert shutter["opens_s"][-1] - shutter["opens_s"][0] == pytest.approx(20e-3 * (rows - 1) / rows, rel=1e-9)


def test_the_way_of_the_image_is_that_of_the_angle_on_the_sensor():
    motion = figures("motion.camera.pan=3 deg/s", "motion.camera.tilt=-4 deg/s", "exposure.time=1/10 s")["motion"]
    shot = load_shot("color_checker")
    way_mm = math.radians(0.5) * shot.lens.image_distance_mm
    assert motion["way_px"] == pytest.approx(way_mm / (1e-3 * shot.camera.pixel_pitch_um), rel=1e-12)
    assert figures()["motion"] is None and figures("motion.camera.pan=0 deg/s")["motion"] is None


def test_a_pinhole_has_no_lens():
    assert figures("lens={pinhole: {diameter: 0.3 mm, distance: 50 mm}}")["lens"] is None
