"""Series: frames that one camera takes one after the other, on one clock."""

import csv
import itertools

import pytest
from helpers.small_sweep import SHOT, read_sweep
from helpers.tiny_shot import tiny_folder

from simulator.config.sweep import Sweep
from simulator.errors import PhotositeError
from simulator.exposure.later_exposures import later_exposures
from simulator.pipeline.planner import plan
from simulator.studies.sweep_runner import run_sweep


def times(sweep: Sweep) -> list[tuple[float, float]]:
    exposures = [point.shot().exposure for point in sweep]
    return [(one.start_s, one.time_s) for one in exposures]


def test_frames_of_a_series_are_released_an_interval_apart(tmp_path):
    sweep = read_sweep(
        tmp_path, {"series": {"frames": 4, "interval": "40 ms"}}, SHOT.replace("iso: 100", "iso: 100, start: 1 s")
    )
    assert times(sweep) == [(1.0, 0.008), (1.04, 0.008), (1.08, 0.008), (1.12, 0.008)]
    seeds = [point.shot().seeds for point in sweep]
    assert [one.frame for one in seeds] == [40, 41, 42, 43] and len({one.body for one in seeds}) == 1


def test_a_bracket_repeats_its_stops_and_waits_the_gap_after_each_exposure(tmp_path):
    sweep = read_sweep(tmp_path, {"series": {"frames": 5, "gap": "2 ms", "bracket": [0, -1, 1]}})
    assert [time for _, time in times(sweep)] == [0.008, 0.004, 0.016, 0.008, 0.004]
    assert [start for start, _ in times(sweep)] == pytest.approx([0.0, 0.010, 0.016, 0.034, 0.044], abs=1e-12)


def hdr_shot(camera: str = "base: sony_a7s2, hdr_readout: {exposures: [1, 0.25]}", time: str = "10 ms") -> str:
    return SHOT.replace("camera: sony_a7s2", f"camera: {{{camera}}}").replace("1/125 s", time)


def test_a_frame_lasts_until_the_last_exposure_of_its_readings_ends(tmp_path):
    """Exposures follow each other: 10 ms and a quarter of it. Readings of one charge, or of another gain, take no more time."""
    series = {"frames": 3, "gap": "1 ms"}
    assert times(read_sweep(tmp_path, {"series": series}, hdr_shot())) == [(0.0, 0.01), (0.0135, 0.01), (0.027, 0.01)]
    for shot in (point.shot() for point in read_sweep(tmp_path, {"series": series}, hdr_shot())):
        (later,) = later_exposures(shot.exposure, shot.camera)
        assert later.start_s + later.time_s == pytest.approx(shot.exposure.start_s + 0.0125, rel=1e-12)
    once = hdr_shot("base: sony_a7s2, hdr_readout: {exposures: [1, 1, 0.5], gains: [1, 0.25, 0.25]}")
    assert [start for start, _ in times(read_sweep(tmp_path, {"series": series}, once))] == [0.0, 0.016, 0.032]
    gains = hdr_shot("base: sony_a7s2, hdr_readout: {gains: [1, 0.25]}").replace("iso: 100", "iso: 1600")
    assert [start for start, _ in times(read_sweep(tmp_path, {"series": series}, gains))] == [0.0, 0.011, 0.022]
    bracket = read_sweep(tmp_path, {"series": {"frames": 4, "gap": "0 s", "bracket": [0, 1]}}, hdr_shot())
    assert [start for start, _ in times(bracket)] == pytest.approx([0.0, 0.0125, 0.0375, 0.05], abs=1e-12)


def test_the_readings_are_those_of_the_camera_of_the_point(tmp_path):
    vary = {"camera": ["sony_a7s2", {"base": "sony_a7s2", "hdr_readout": {"exposures": [1, 0.5]}}]}
    sweep = read_sweep(tmp_path, {"vary": vary, "series": {"frames": 2}}, hdr_shot())
    assert [start for start, _ in times(sweep)] == [0.0, 0.01, 0.0, 0.015]


def test_exposures_that_together_outlast_the_interval_are_refused(tmp_path):
    told = r"s.yaml:\d+: sweep.series: exposures of 0.0125 s together outlast the interval of 0.01 s"
    with pytest.raises(PhotositeError, match=told):
        read_sweep(tmp_path, {"series": {"frames": 2, "interval": "10 ms"}}, hdr_shot())
    assert times(read_sweep(tmp_path, {"series": {"frames": 2, "interval": "12.5 ms"}}, hdr_shot()))[1] == (0.0125, 0.01)
    with pytest.raises(PhotositeError, match="camera.hdr_readout.exposures"):  # the camera is what is wrong
        read_sweep(tmp_path, {"series": {"frames": 2}}, hdr_shot("base: sony_a7s2, hdr_readout: {exposures: [1, 2]}"))


def test_a_metered_bracket_varies_the_compensation_and_needs_an_interval(tmp_path):
    text = SHOT.replace("time: 1/125 s", "mode: aperture_priority, compensation: 0.5")
    sweep = read_sweep(tmp_path, {"series": {"frames": 4, "interval": "1 s", "bracket": [0, -1, 1]}}, text)
    exposures = [point.shot().exposure for point in sweep]
    assert [(one.start_s, one.compensation) for one in exposures] == [(0.0, 0.5), (1.0, -0.5), (2.0, 1.5), (3.0, 0.5)]
    assert sweep.keys == ["exposure.start", "exposure.compensation"]
    for series in ({"frames": 2}, {"frames": 2, "gap": "1 s", "bracket": [0, 1]}):
        with pytest.raises(PhotositeError, match="sweep.series.*no gap says when it ends; give an interval"):
            read_sweep(tmp_path, {"series": series}, text)


@pytest.mark.parametrize("several", [False, True])
def test_exposures_that_the_camera_chooses_longer_than_the_interval_are_refused(tmp_path, several):
    """Dim light takes 8 s at 1 stop and 4 s at 0; a second reading of half the time makes 6 s of the 4."""
    tiny_folder(tmp_path)
    hdr = "{base: tiny.yaml, hdr_readout: {exposures: [1, 0.5]}}" if several else "tiny.yaml"
    text = SHOT.replace("time: 1/125 s", "mode: aperture_priority").replace("camera: sony_a7s2", f"camera: {hdr}")
    text = text.replace("100 cd/m^2", "0.08 cd/m^2")
    sweep = read_sweep(tmp_path, {"series": {"frames": 2, "interval": "5 s", "bracket": [0, 1]}}, text)
    rows = run_sweep(sweep, tmp_path, take=lambda shot, directory: plan(shot))
    told = [str(row.error) for row in rows]
    together = " together" if several else ""
    fix = "the interval of 5 s; give a longer one, or limit the time by exposure.dials.longest"
    assert told[1] == f"sweep.series: exposures of {12 if several else 8} s{together} outlast {fix}"
    assert told[0] == (f"sweep.series: exposures of 6 s{together} outlast {fix}" if several else "None")


def test_a_bracket_of_compensation_with_a_stated_time_fits_into_the_interval_or_is_refused(tmp_path):
    """The time stays, and the bracket is one of apertures or ISOs."""
    for text in (SHOT.replace("time:", "mode: shutter_priority, time:"), SHOT.replace("time:", "auto_iso: {}, time:")):
        series = {"frames": 2, "bracket": [0, 3]}
        assert times(read_sweep(tmp_path, {"series": series | {"interval": "8 ms"}}, text)) == [(0.0, 0.008), (0.008, 0.008)]
        with pytest.raises(PhotositeError, match="sweep.series: exposures of 0.008 s outlast the interval of 0.007 s"):
            read_sweep(tmp_path, {"series": series | {"interval": "7 ms"}}, text)


def test_every_point_of_a_sweep_may_be_a_series(tmp_path):
    sweep = read_sweep(
        tmp_path, {"vary": {"exposure.iso": [100, 200], "lens.f_number": ["f/2", "f/4"]}, "series": {"frames": 2}}
    )
    taken = [(one.exposure.iso, one.lens.f_number, one.exposure.start_s) for one in (point.shot() for point in sweep)]
    assert taken == list(itertools.product([100, 200], [2.0, 4.0], [0.0, 0.008]))
    order = [(point.values["lens.f_number"], point.values["exposure.start"]) for point in sweep.by_light()]
    assert [len(list(group)) for _, group in itertools.groupby(order)] == [2, 2, 2, 2]  # ISO alone leaves the light as it is


def test_few_points_have_every_value_and_every_frame(tmp_path):
    vary = {"exposure.iso": [100, 200, 400], "lens.f_number": {"from": "f/2", "to": "f/8", "steps": 10}}
    sweep = read_sweep(tmp_path, {"vary": vary, "series": {"frames": 4, "gap": "1 ms", "bracket": [0, -1, 1]}})
    points = list(sweep.covering_points())
    assert len({point.index for point in points}) == len(points) < 20 < len(sweep) == 120
    for key in sweep.values:
        assert {point.values[key] for point in points} == {point.values[key] for point in sweep}
    assert [point.index for point in points[:4]] == [0, 1, 2, 3]


def test_a_series_beside_values_that_are_zipped(tmp_path):
    vary = {"exposure.iso": [100, 200], "exposure.time": ["1/50 s", "1/100 s"]}
    sweep = read_sweep(tmp_path, {"mode": "zip", "vary": vary, "series": {"frames": 2, "interval": "20 ms"}})
    assert times(sweep) == [(0.0, 0.02), (0.02, 0.02), (0.0, 0.01), (0.02, 0.01)]


@pytest.mark.parametrize(
    "series, message",
    [
        ({"frames": 2, "interval": "5 ms"}, "outlast the interval"),
        ({"frames": 2, "interval": "9 ms", "bracket": [0, 1]}, "exposures of 0.016 s outlast the interval of 0.009 s"),
        ({"frames": 2, "interval": "9 ms", "gap": "1 ms"}, "leave one of them out"),
        ({"frames": 2, "gap": "-1 ms"}, "0 s or more"),
        ({"frames": 0}, "series.frames = 0"),
        ({"frames": 2, "bracket": [0, 5000]}, "series.bracket.1 = 5000"),
        ({"frames": 2, "interval": 40}, "has no unit"),
    ],
)
def test_a_series_that_cannot_be_taken_is_named_with_its_line(tmp_path, series, message):
    with pytest.raises(PhotositeError, match=message) as found:
        read_sweep(tmp_path, {"series": series})
    assert found.value.line >= 6


def test_the_manifest_of_a_series_has_the_times_of_its_frames(tmp_path):
    sweep = read_sweep(tmp_path, {"series": {"frames": 2, "gap": "0 s", "bracket": [0, -1]}})
    run_sweep(sweep, tmp_path, take=lambda shot, directory: None)
    with open(tmp_path / "manifest.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["exposure.start"], row["exposure.time"]) for row in rows] == [("0 s", "0.008 s"), ("0.008 s", "0.004 s")]


def test_the_flow_of_a_frame_of_a_series_leads_to_the_middle_of_the_next(tmp_path):
    """A bracket of 10, 5 and 20 ms, 2 ms apart: from 5 ms to 14.5 ms, and from there to 29 ms."""
    text = SHOT.replace("time: 1/125 s", "time: 10 ms") + "truth: [flow]\nmotion: {camera: {pan: 1 deg/s}}\n"
    sweep = read_sweep(tmp_path, {"series": {"frames": 3, "gap": "2 ms", "bracket": [0, -1, 1]}}, text)
    first, second, last = (point.shot() for point in sweep)
    middles_s = [shot.exposure.start_s + 0.5 * shot.exposure.time_s for shot in (first, second, last)]
    assert first.motion.flow_time_s == pytest.approx(middles_s[1] - middles_s[0], rel=1e-12)
    assert second.motion.flow_time_s == pytest.approx(middles_s[2] - middles_s[1], rel=1e-12)
    stated = read_sweep(tmp_path, {"series": {"frames": 2}}, text.replace("{pan: 1 deg/s}", "{pan: 1 deg/s}, flow_time: 1 s"))
    assert [point.shot().motion.flow_time_s for point in stated] == [1.0, 1.0]


def test_a_bracket_whose_times_the_camera_chooses_needs_the_time_of_its_flow(tmp_path):
    """Each frame's time is known when it is planned, and the middle of the next exposure with it."""
    text = SHOT.replace("time: 1/125 s", "mode: aperture_priority") + "truth: [flow]\nmotion: {camera: {pan: 1 deg/s}}\n"
    bracket = {"series": {"frames": 3, "interval": "1 s", "bracket": [0, 3]}}
    with pytest.raises(PhotositeError, match=r"s.yaml:\d+: sweep.series: .*give motion.flow_time, or leave flow out of truth"):
        read_sweep(tmp_path, bracket, text)
    stated = read_sweep(tmp_path, bracket, text.replace("{pan: 1 deg/s}", "{pan: 1 deg/s}, flow_time: 0.9 s"))
    assert [point.shot().motion.flow_time_s for point in stated] == [0.9] * 3
    for same in (  # frames of one time, so that their middles are an interval apart
        read_sweep(tmp_path, {"series": {"frames": 3, "interval": "1 s"}}, text),
        read_sweep(tmp_path, bracket, text.replace("aperture_priority", "shutter_priority, time: 1/125 s")),
        read_sweep(tmp_path, bracket, text.replace("mode: aperture_priority", "time: 1/125 s, auto_iso: {}")),
    ):
        assert [point.shot().motion.flow_time_s for point in same] == [1.0] * 3


@pytest.mark.parametrize("path", ["clip: handycam_run, seed: 1", "path: turn.csv"])
def test_a_path_that_is_shorter_than_a_series_is_refused_before_its_first_frame(tmp_path, path):
    (tmp_path / "turn.csv").write_text("time_s,rotation_euler_y\n0,0\n1,0.01\n2,0.02\n")
    text = SHOT + f"motion: {{camera: {{{path}}}}}\n"
    told = r"to 2[.\d]* s of the shot's clock, .* 0 s to 3.508 s; .*for the 6 frames of sweep.series"
    with pytest.raises(PhotositeError, match=told) as found:
        read_sweep(tmp_path, {"series": {"frames": 6, "interval": "700 ms"}}, text)
    assert found.value.key.startswith("motion.camera.") and found.value.line is not None
    assert len(read_sweep(tmp_path, {"series": {"frames": 4, "interval": "500 ms"}}, text)) == 4


def test_a_path_that_ends_before_the_last_exposure_of_a_frame_is_refused_before_its_first(tmp_path):
    """Exposures of 0.8 and 0.4 s, so that the second frame is open from 1.2 to 2.4 s."""
    (tmp_path / "turn.csv").write_text("time_s,rotation_euler_y\n0,0\n1,0.01\n2,0.02\n")
    text = hdr_shot("base: sony_a7s2, hdr_readout: {exposures: [1, 0.5]}", "0.8 s") + "motion: {camera: {path: turn.csv}}\n"
    series = {"frames": 2, "interval": "1.2 s"}
    with pytest.raises(
        PhotositeError, match=r"to 2 s of the shot's clock, .* 0 s to 2.4 s; .*for the 2 frames of sweep.series"
    ):
        read_sweep(tmp_path, {"series": series}, text)
