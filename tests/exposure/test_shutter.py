"""Shutters give each line its own interval: closed forms, light conserved, and one clear message for what cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.errors import PhotositeError
from simulator.exposure.shutter import (
    AnyShutter,
    CurtainShutter,
    FirstCurtainShutter,
    GlobalShutter,
    LeafShutter,
    RollingShutter,
)

CAMERA = small_camera(60, 48)  # 0.3 x 0.24 mm
HEIGHT_MM = 0.24
ROWS = np.arange(48)


def line_times(shutter: AnyShutter, time_s: float = 0.01, f_number: float = 6.0, working: float | None = None):
    """The only trapezoid of a shutter."""
    (times,) = shutter.line_times(CAMERA, time_s, f_number, f_number if working is None else working)
    edges = np.stack([times.opens_s, times.open_s, times.closes_s, times.closed_s])
    assert (np.diff(edges, axis=0) >= 0).all() and (times.peak > 0).all() and (times.peak <= 1).all()
    return times


def test_rolling_rows_follow_each_other_by_the_readout_time_over_the_rows():
    times = line_times(RollingShutter(0.02), 0.005)
    assert times.axis == "rows"
    np.testing.assert_allclose(times.opens_s, ROWS * 0.02 / 48, atol=1e-15)
    np.testing.assert_allclose(times.closed_s - times.opens_s, 0.005, atol=1e-15)


def test_each_scan_order_begins_at_its_edge():
    rows = line_times(RollingShutter(0.02, "bottom_to_top"))
    assert rows.axis == "rows" and rows.opens_s[-1] == 0 and rows.opens_s[0] == pytest.approx(0.02 * 47 / 48)
    left, right = (line_times(RollingShutter(0.02, order)) for order in ("left_to_right", "right_to_left"))
    assert left.axis == right.axis == "columns" and len(left.peak) == 60
    np.testing.assert_array_equal(left.opens_s, right.opens_s[::-1])
    assert left.opens_s[0] == 0 and left.opens_s[-1] == pytest.approx(0.02 * 59 / 60)
    assert line_times(RollingShutter(0.02, "none")).axis == "all"


def test_the_cameras_readout_time_is_that_of_a_shutter_that_states_none():
    (own,) = RollingShutter().line_times(replace(CAMERA, readout_time_s=0.05), 0.01, 4.0, 4.0)
    np.testing.assert_array_equal(own.opens_s, line_times(RollingShutter(0.05)).opens_s)
    with pytest.raises(PhotositeError, match="exposure.shutter.readout_time = none: Photosite test states none; give the time"):
        RollingShutter().line_times(CAMERA, 0.01, 4.0, 4.0)


def test_a_readout_in_no_time_is_a_global_shutter():
    assert line_times(RollingShutter(0.0)).is_common


@pytest.mark.parametrize("acceleration", [0.0, 40.0, -40.0, 53.0])
def test_curtains_expose_every_line_for_the_same_time_however_fast_they_go(acceleration):
    for time_s in (1e-5, 1e-3, 0.1):  # a slit much narrower than the cone of light, one like it, and fully open
        times = line_times(CurtainShutter(0.003, acceleration, 0.5), time_s)
        np.testing.assert_allclose(times.effective_s, time_s, rtol=1e-10)


def test_a_curtain_is_where_its_acceleration_brings_it():
    times = line_times(CurtainShutter(0.003, 40.0))
    middle = times.opens_s - times.opens_s[0]
    speed = 1e-3 * HEIGHT_MM / 0.003 - 0.5 * 40.0 * 0.003  # when it begins [m/s]
    place_m = 5e-6 * (ROWS + 0.5)
    start = (-speed + np.sqrt(speed**2 + 2 * 40.0 * place_m)) / 40.0
    np.testing.assert_allclose(middle, start - start[0], atol=1e-15)
    assert middle[1] - middle[0] > 2 * (middle[-1] - middle[-2])


@pytest.mark.parametrize(("slit_over_distance", "f_number", "efficiency"), [(1.0, 6.0, 6 / 7), (0.5, 4.0, 2 / 3)])
def test_efficiency_of_a_slit_is_that_of_ives(slit_over_distance, f_number, efficiency):
    """Exposure over the time for which a line sees any light: a / (a + d / N)."""
    distance_mm, time_s = 0.02, 0.001
    travel_s = HEIGHT_MM / (slit_over_distance * distance_mm) * time_s
    times = line_times(CurtainShutter(travel_s, 0.0, distance_mm), time_s, f_number=1.0, working=f_number)
    np.testing.assert_allclose(times.effective_s / (times.closed_s - times.opens_s), efficiency, rtol=1e-9)


def test_an_electronic_first_curtain_exposes_for_the_time_between_reset_and_curtain():
    shutter = FirstCurtainShutter(0.0035, 0.0035, acceleration_m_per_s2=30.0)
    times, curtain = line_times(shutter, 0.004), line_times(CurtainShutter(0.0035, 30.0), 0.004)
    reset = (ROWS + 0.5) * 0.0035 / 48
    crossing = curtain.opens_s - curtain.opens_s[0]
    np.testing.assert_allclose(times.opens_s, reset, atol=1e-15)
    ends = times.effective_s + reset
    np.testing.assert_allclose(ends - ends[0], crossing, atol=1e-12)
    assert np.interp(24.0, ROWS + 0.5, times.effective_s) == pytest.approx(0.004, rel=1e-4)  # in the middle of the frame
    assert np.ptp(times.effective_s) > 2e-4  # the ends differ from it


def test_a_reset_that_moves_as_the_curtain_does_gives_even_frames():
    shutter = FirstCurtainShutter(0.0035, 0.0035, 30.0, 30.0, distance_mm=0.001)
    np.testing.assert_allclose(line_times(shutter, 0.004).effective_s, 0.004, rtol=1e-10)


def test_a_curtain_that_overtakes_the_reset_is_one_message():
    with pytest.raises(PhotositeError) as caught:
        line_times(FirstCurtainShutter(0.010, 0.002), 1 / 1000)
    assert "exposure.time = 0.001 s: the second curtain passes line 47 0.00292 s before that line is reset" in str(caught.value)
    assert "give at least 0.00396 s" in str(caught.value)


def test_a_reset_within_the_soft_edge_of_the_curtain_leaves_the_rest_of_the_edge():
    shutter = FirstCurtainShutter(0.003, 0.003, distance_mm=0.02)  # the edge takes 0.02 / 6 / 0.24 * 3 ms = 42 us
    times = line_times(shutter, 1e-5)
    edge_s, left_s = 0.02 / 6 / HEIGHT_MM * 0.003, 1e-5 + 0.5 * 0.02 / 6 / HEIGHT_MM * 0.003
    np.testing.assert_allclose(times.peak, left_s / edge_s, rtol=1e-9)
    np.testing.assert_allclose(times.effective_s, 0.5 * left_s**2 / edge_s, rtol=1e-9)


def test_a_leaf_shutter_is_open_for_the_time_less_half_of_its_moves():
    times = line_times(LeafShutter(0.001, 0.002), 0.008)
    assert times.axis == "all" and times.effective_s == pytest.approx([0.008 - 0.0015])
    assert line_times(LeafShutter(0.001, 0.002), 0.003).effective_s == pytest.approx([0.0015])  # never stays open: a half


def test_a_leaf_that_turns_back_on_the_way_opens_in_proportion():
    times = line_times(LeafShutter(0.001, 0.002), 0.0015)
    assert times.peak == pytest.approx([0.5]) and times.effective_s == pytest.approx([0.5 * 0.5 * 0.0015])


def test_a_stopped_down_leaf_shutter_is_more_efficient():
    """A quarter of the area is uncovered in a quarter of the time, and covered in the last quarter."""
    shutter = LeafShutter(0.001, 0.001, widest_f_number=2.8)
    assert line_times(shutter, 0.002, 2.8).effective_s == pytest.approx([0.001])
    assert line_times(shutter, 0.002, 5.6).effective_s == pytest.approx([0.00175])
    assert line_times(shutter, 0.001, 5.6).effective_s == pytest.approx([0.00075])
    assert line_times(shutter, 0.0005, 5.6).effective_s == pytest.approx([0.00025])  # turns back as the stop is uncovered
    for f_number in (2.0, np.nan):
        with pytest.raises(PhotositeError, match="exposure.shutter.widest_f_number = f/2.8: needs a lens"):
            line_times(shutter, 0.002, f_number)


def test_the_ghost_of_a_global_shutter_grows_with_the_wait_of_the_line():
    """PLS 1 - 0.99987; of a line that waits for T it adds as much of the exposure."""
    own, ghost = GlobalShutter(0.00013, 0.02).line_times(CAMERA, 0.005, 4.0, 4.0)
    assert own.is_common
    np.testing.assert_allclose(ghost.effective_s, 0.00013 * ROWS * 0.02 / 48, rtol=1e-9, atol=1e-18)
    assert (ghost.opens_s == 0.005).all()
    (plain,) = GlobalShutter(0.0).line_times(CAMERA, 0.005, 4.0, 4.0)
    assert plain.axis == "all"


@pytest.mark.parametrize(
    ("shutter", "message"),
    [
        (lambda: RollingShutter(-0.1), "exposure.shutter.readout_time = -0.1 s: give a time of 0 s or more"),
        (lambda: RollingShutter(0.1, "upwards"), "exposure.shutter.scan_order = upwards: give one of top_to_bottom"),
        (lambda: GlobalShutter(1.0), "exposure.shutter.parasitic_light = 1.0: give a share"),
        (lambda: CurtainShutter(-0.1), "exposure.shutter.travel_time = -0.1 s"),
        (lambda: CurtainShutter(0.1, distance_mm=-1.0), "exposure.shutter.distance = -1 mm"),
        (lambda: CurtainShutter(0.1, travel="none"), "exposure.shutter.travel = none"),
        (lambda: FirstCurtainShutter(-0.1, 0.1), "exposure.shutter.reset_time = -0.1 s"),
        (lambda: LeafShutter(0.1, -1.0), "exposure.shutter.closing = -1 s"),
        (lambda: LeafShutter(0.1, 0.1, 0.0), "exposure.shutter.widest_f_number = 0.0"),
    ],
)
def test_settings_out_of_range_are_refused(shutter, message):
    with pytest.raises(PhotositeError, match=message):
        shutter()


def test_a_curtain_that_would_stand_still_is_refused_with_the_most_that_it_can_do():
    for acceleration in (54.0, -54.0):
        with pytest.raises(PhotositeError, match=r"acceleration = -?54 m/s\^2: .* starts or ends at rest with 53.33 m/s\^2"):
            line_times(CurtainShutter(0.003, acceleration))


def test_a_curtain_before_a_bare_sensor_is_refused():
    with pytest.raises(PhotositeError, match="distance = 1 mm: its shadow depends on the f-number"):
        line_times(CurtainShutter(0.003, 0.0, 1.0), working=np.nan)


@pytest.mark.parametrize("time_s", [1e-6, 3600.0])
def test_a_microsecond_and_an_hour_are_exposed_in_full(time_s):
    for shutter in (RollingShutter(0.1), CurtainShutter(0.003, 20.0, 0.5), FirstCurtainShutter(0.003, 0.003)):
        np.testing.assert_allclose(line_times(shutter, time_s).effective_s, time_s, rtol=1e-9)
