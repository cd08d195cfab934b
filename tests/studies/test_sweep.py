"""Sweeps: the points are right, made lazily, checked before the run, and not run twice."""

import csv
import itertools
import json
import os
import shutil
import tracemalloc
from functools import partial

import pytest
from helpers.linked_files import put_kernel, put_shot
from helpers.small_sweep import SHOT, read_sweep, write_sweep

from simulator import __version__
from simulator.config import load_sweep
from simulator.config.shot_file import load_document
from simulator.config.sweep import Sweep
from simulator.errors import PhotositeError
from simulator.pipeline.input_files import fingerprints
from simulator.pipeline.light_cache import LightCache
from simulator.studies.sweep_runner import SKIPPED, run_sweep, take


def values(sweep: Sweep, key: str) -> list:
    return [point.values[key] for point in sweep]


def test_product_takes_every_combination_the_last_key_fastest(tmp_path):
    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200], "lens.f_number": ["f/2", "f/4", "f/8"]}})
    taken = [(point.shot().exposure.iso, point.shot().lens.f_number) for point in sweep]
    assert taken == list(itertools.product([100, 200], [2.0, 4.0, 8.0]))
    assert [point.name for point in sweep] == [f"s_{index:04d}" for index in range(6)]
    assert [point.shot().name for point in sweep] == [point.name for point in sweep]


def test_zip_takes_value_by_value(tmp_path):
    sweep = read_sweep(tmp_path, {"mode": "zip", "vary": {"exposure.iso": [100, 200], "exposure.time": ["1/50 s", "1/100 s"]}})
    assert [(point.shot().exposure.iso, point.shot().exposure.time_s) for point in sweep] == [(100, 0.02), (200, 0.01)]


def test_zip_of_unequal_lengths_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match="exposure.iso has 2, lens.f_number has 1"):
        read_sweep(tmp_path, {"mode": "zip", "vary": {"exposure.iso": [100, 200], "lens.f_number": ["f/2"]}})


def test_log2_steps_are_equal_stops_and_keep_the_ends_exactly(tmp_path):
    sweep = read_sweep(tmp_path, {"vary": {"lens.f_number": {"from": "f/1", "to": "f/16", "steps": 5, "scale": "log2"}}})
    assert [point.shot().lens.f_number for point in sweep] == [1.0, 2.0, 4.0, 8.0, 16.0]
    sweep = read_sweep(tmp_path, {"vary": {"exposure.time": {"from": "1/3 s", "to": "1/12 s", "steps": 3, "scale": "log2"}}})
    taken = [point.shot().exposure.time_s for point in sweep]
    assert taken[0] == 1 / 3 and taken[2] == 1 / 12 and taken[1] == pytest.approx(1 / 6, rel=1e-11)


def test_steps_of_t_stops_are_t_stops(tmp_path):
    sweep = read_sweep(tmp_path, {"vary": {"lens.t_stop": {"from": "T/4", "to": "T/16", "steps": 3, "scale": "log2"}}})
    assert [point.shot().lens.t_stop for point in sweep] == [4.0, 8.0, 16.0] and sweep[1].values["lens.t_stop"] == "T/8"


def test_linear_steps_and_whole_numbers(tmp_path):
    steps = {"from": "1 m", "to": "400 cm", "steps": 4}
    assert [point.shot().lens.focus_distance_m for point in read_sweep(tmp_path, {"vary": {"lens.focus_distance": steps}})] == [
        1,
        2,
        3,
        4,
    ]
    isos = {"from": 100, "to": 1600, "steps": 5, "scale": "log2"}
    assert values(read_sweep(tmp_path, {"vary": {"exposure.iso": isos}}), "exposure.iso") == [100, 200, 400, 800, 1600]
    assert values(read_sweep(tmp_path, {"vary": {"seeds.frame": {"range": [3, 9, 2]}}}), "seeds.frame") == [3, 5, 7]


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ({"exposure.iso": []}, "give at least one value"),
        ({"exposure.iso": {"range": [5, 5]}}, "is empty"),
        ({"exposure.iso": {"range": [5, 9, 0]}}, "step by 0"),
        ({"exposure.iso": {"from": 100, "to": 1800, "steps": 3}}, "exposure.iso = 1800"),
        ({"exposure.iso": {"from": 100, "to": 200, "steps": 4, "scale": "log2"}}, "exposure.iso = 125.9"),
        ({"exposure.time": {"from": "1 s", "to": 2, "steps": 3}}, "both ends a unit"),
        ({"exposure.time": {"from": "1 s", "to": "2 mm", "steps": 3}}, "is a length"),
        ({"exposure.time": {"from": "0 s", "to": "1 s", "steps": 3, "scale": "log2"}}, "above 0"),
        ({"lens.focus_distance": {"from": "1 m", "to": "inf m", "steps": 3}}, "infinity"),
        ({"lens.f_number": {"from": "f/1", "to": "f/2", "steps": 1}}, "steps = 1"),
        ({"lens.f_number": {"from": "f/1", "to": "f/2", "step": 1}}, "did you mean `steps`?"),
        ({"lens.fnumber": ["f/1"]}, "did you mean `f_number`?"),
        ({"lens.f_number": ["f/1"] * 200 + ["f/x"]}, "lens.f_number = f/x"),
        ({"seeds.frame": {"range": [0, 10**9]}}, "sweep.vary.seeds.frame: gives 1000000000 values; 10000000 are possible"),
        ({"seeds.frame": {"range": [10**20, 0, -1]}}, "sweep.vary.seeds.frame: gives more than 10^18 values; 10000000 are"),
        (dict.fromkeys("ab", {"from": 1, "to": 2, "steps": 10**6}), "sweep: gives 1000000000000 points; 10000000 are possible"),
        (dict.fromkeys("abcd", {"from": 1, "to": 2, "steps": 10**6}), "sweep: gives more than 10^18 points; 10000000 are"),
        ({"exposure.iso": {"from": 10**400, "to": 2, "steps": 5}}, "sweep.vary.exposure.iso: is too large a number"),
        ({"exposure.iso": {"from": -(10**308), "to": 10**308, "steps": 5}}, "the ends lie too far apart"),
        ({"exposure.iso": {"from": 1e-300, "to": 1e300, "steps": 5, "scale": "log2"}}, "the ends lie too far apart"),
    ],
)
def test_a_mistake_anywhere_is_found_before_the_first_point_runs(tmp_path, vary, message):
    with pytest.raises(PhotositeError) as caught:
        read_sweep(tmp_path, {"vary": vary})
    assert message in str(caught.value) and str(tmp_path / "s.yaml") in str(caught.value)


def test_values_that_go_together_only_point_by_point_are_not_refused(tmp_path):
    # A 4000 mm lens cannot focus at the base shot's 2 m, but no point asks it to.
    vary = {"lens.focal_length": ["50 mm", "4000 mm"], "lens.focus_distance": ["2 m", "100 m"]}
    assert len(read_sweep(tmp_path, {"mode": "zip", "vary": vary})) == 2


def test_a_missing_picture_is_found_before_the_first_point_runs(tmp_path):
    text = SHOT.replace("chart: flat_field", "image: a.png")
    (tmp_path / "a.png").touch()
    with pytest.raises(PhotositeError, match=r"s.yaml:8 \(sweep\): scene.image = .*b.png: no such file \(for s_0001\)"):
        read_sweep(tmp_path, {"vary": {"scene.image": ["a.png", "b.png"]}}, text)


def test_every_point_has_fresh_noise_unless_asked(tmp_path):
    vary = {"exposure.iso": [100, 200, 400]}
    frames = [point.shot().seeds.frame for point in read_sweep(tmp_path, {"vary": vary})]
    assert frames == [40, 41, 42]
    assert {point.shot().seeds.frame for point in read_sweep(tmp_path, {"vary": vary, "same_noise": True})} == {40}
    own = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200], "seeds.frame": [5, 6]}})
    assert [point.shot().seeds.frame for point in own] == [5, 6, 5, 6]


def test_frame_seeds_that_would_run_over_are_refused_not_wrapped(tmp_path):
    with pytest.raises(PhotositeError, match="seeds.frame = 4294967296"):
        read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200]}}, SHOT.replace("40", "4294967295"))


def test_a_million_points_are_not_made_up_front(tmp_path):
    path = write_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200], "seeds.frame": {"range": [0, 500_000]}}})
    document = load_document(path)
    tracemalloc.start()
    sweep = Sweep(document)
    assert len(sweep) == 1_000_000
    assert sweep[999_999].values == {"exposure.iso": 200, "seeds.frame": 499_999}
    assert next(iter(sweep)).name == "s_000000"
    _, most_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most_bytes < 1_000_000  # less than a byte a point


def test_another_camera_can_be_swept(tmp_path):
    sweep = read_sweep(tmp_path, {"vary": {"camera": ["sony_a7s2", "ideal"]}})
    assert [point.shot().camera.model for point in sweep] == ["ILCE-7SM2", "Ideal"]


@pytest.mark.parametrize("key", ["camera", "camera.base"])
def test_keys_of_the_camera_are_laid_over_each_that_is_varied(tmp_path, key):
    """Those of vary in any order, and those of --set, also where it names another camera."""
    vary = {"camera.fill_factor": [0.5], key: ["sony_a7s2", "nikon_d850"]}
    given = ["camera.window={x: 0, y: 0, width: 64, height: 48}", "camera.fill_factor=0.75", "exposure.iso=200"]
    for settings in (given, [*given, "camera=canon_550d"]):
        taken = [(point.values, point.shot()) for point in load_sweep(write_sweep(tmp_path, {"vary": vary}), iter(settings))]
        assert [shot.camera.make for _, shot in taken] == ["Sony", "Nikon"]
        assert {(shot.camera.frame.width, shot.camera.fill_factor, shot.exposure.iso) for _, shot in taken} == {(64, 0.5, 200)}
        assert [values["camera.fill_factor"] for values, _ in taken] == [0.5, 0.5]
    del vary["camera.fill_factor"]
    mapping = {"camera.fill_factor": 0.75}
    sweep = load_sweep(write_sweep(tmp_path, {"vary": vary}), mapping)
    assert [point.shot().camera.fill_factor for point in sweep] == [0.75, 0.75]


def test_a_setting_that_one_of_the_cameras_refuses_is_told(tmp_path):
    path = write_sweep(tmp_path, {"vary": {"camera": ["sony_a7s2", "ideal"]}})
    with pytest.raises(PhotositeError, match="--set camera.widht=3.*did you mean `width`?"):
        load_sweep(path, ["camera.widht=3"])
    with pytest.raises(PhotositeError, match="--set camera.window=.*: camera.window"):
        load_sweep(path, ["camera.window={x: 4000, y: 0, width: 512, height: 16}"])


class Shutter:
    """Stands in for simulation and saving: counts, and writes a DNG and the sidecar last as the real one does."""

    def __init__(self, fail=(), version=__version__):
        self.taken, self.fail, self.version = [], fail, version

    def __call__(self, shot, directory):
        self.taken.append(shot.name)
        if shot.name in self.fail:
            raise PhotositeError("the disk is full")
        (directory / f"{shot.name}.dng").touch()
        told = {"versions": {"photosite": self.version}, "inputs": fingerprints(shot.scene, shot.lens, shot.motion)}
        (directory / f"{shot.name}.json").write_text(json.dumps(told))


def manifest(folder) -> list[dict]:
    with open(folder / "manifest.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_a_point_that_stands_is_skipped_and_a_changed_one_redone(tmp_path):
    vary = {"exposure.iso": [100, 200, 400]}
    out, first, second, third = tmp_path / "out", Shutter(), Shutter(), Shutter()
    run_sweep(read_sweep(tmp_path, {"vary": vary}), out, take=first)
    assert first.taken == ["s_0000", "s_0001", "s_0002"]
    assert [row["status"] for row in manifest(out)] == ["done"] * 3
    (out / "s_0001.json").unlink()
    run_sweep(read_sweep(tmp_path, {"vary": vary}), out, take=second)
    assert second.taken == ["s_0001"]
    assert [row["status"] for row in manifest(out)] == [SKIPPED, "done", SKIPPED]
    run_sweep(read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200, 800]}}), out, take=third)
    assert third.taken == ["s_0002"]
    assert manifest(out)[2]["exposure.iso"] == "800"
    again = Shutter()
    run_sweep(read_sweep(tmp_path, {"vary": vary}), out, take=again, redo=True)
    assert len(again.taken) == 3


def test_a_point_without_its_truth_is_redone_when_the_truth_is_wanted(tmp_path):
    sweep, out = read_sweep(tmp_path, {"vary": {"exposure.iso": [100]}}), tmp_path / "out"
    for truth, status in ((False, "done"), (False, SKIPPED), (True, "done"), (True, SKIPPED), (False, SKIPPED)):
        shutter = Shutter()
        run_sweep(sweep, out, take=shutter, truth=truth)
        if shutter.taken and truth:
            (out / "s_0000.truth.exr").touch()
        (row,) = manifest(out)
        assert (row["status"], row["truth"]) == (status, "s_0000.truth.exr" if truth else "")


def statuses(sweep: Sweep, out) -> list[str]:
    """Status of each point of a sweep that is run again; "taken" for one that was."""
    return [{"done": "taken"}.get(row.status, row.status) for row in run_sweep(sweep, out, take=Shutter())]


def test_a_point_is_redone_when_the_content_of_its_picture_changes_whatever_the_times(tmp_path):
    picture, other, out = tmp_path / "a.png", tmp_path / "b.png", tmp_path / "out"
    picture.write_bytes(b"one")
    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200]}}, SHOT.replace("chart: flat_field", "image: a.png"))
    assert statuses(sweep, out) == ["taken", "taken"]
    later = (out / "s_0000.json").stat().st_mtime + 10
    os.utime(picture, (later, later))  # touched
    assert statuses(sweep, out) == [SKIPPED, SKIPPED]
    other.write_bytes(b"two")
    os.utime(other, (1e9, 1e9))
    shutil.copy2(other, picture)  # cp -p of an older picture
    assert statuses(sweep, out) == ["taken", "taken"] and statuses(sweep, out) == [SKIPPED, SKIPPED]


def test_a_point_is_redone_when_a_file_changes_that_an_input_file_leads_to(tmp_path):
    put_shot(tmp_path)
    path = tmp_path / "linked.yaml"
    path.write_text(path.read_text() + "sweep: {vary: {exposure.iso: [100]}}\n")
    out = tmp_path / "out"
    assert [statuses(load_sweep(path), out) for _ in range(2)] == [["taken"], [SKIPPED]]
    put_kernel(tmp_path, "green", 5)
    assert [statuses(load_sweep(path), out) for _ in range(2)] == [["taken"], [SKIPPED]]


@pytest.mark.parametrize("text", [None, "", "[]", '{"versions": {}}', '{"inputs": []}'])
def test_a_point_is_redone_when_its_dng_is_gone_or_its_sidecar_tells_nothing(tmp_path, text):
    sweep, out = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200]}}), tmp_path / "out"
    run_sweep(sweep, out, take=Shutter())
    if text is None:
        (out / "s_0000.dng").unlink()
    else:
        (out / "s_0000.json").write_text(text)
    assert statuses(sweep, out) == ["taken", SKIPPED] and (out / "s_0000.dng").exists()


def test_a_point_of_another_version_is_redone(tmp_path):
    sweep, out = read_sweep(tmp_path, {"vary": {"exposure.iso": [100]}}), tmp_path / "out"
    run_sweep(sweep, out, take=Shutter(version="0.0.1"))
    assert statuses(sweep, out) == ["taken"] and statuses(sweep, out) == [SKIPPED]


def test_what_a_simulation_saves_is_up_to_date(tmp_path):
    path = put_shot(tmp_path)
    path.write_text(path.read_text() + "sweep: {vary: {exposure.iso: [100]}}\n")
    found = [run_sweep(load_sweep(path), tmp_path / "out", truth=True)[0].status for _ in range(2)]
    assert found == ["done", SKIPPED]


def test_a_failed_point_is_a_row_and_leaves_no_sidecar(tmp_path):
    out = tmp_path / "out"
    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200, 400]}})
    run_sweep(sweep, out, take=Shutter())
    rows = run_sweep(sweep, out, take=Shutter(fail=["s_0001"]), redo=True)
    assert [row.status for row in rows] == ["done", "failed: the disk is full", "done"]
    assert not (out / "s_0001.json").exists()
    assert manifest(out)[1]["dng"] == ""


def test_three_failures_in_a_row_stop_the_run_and_the_manifest_stands(tmp_path):
    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 125, 160, 200, 250]}})
    with pytest.raises(PhotositeError, match="3 failures in a row"):
        run_sweep(sweep, tmp_path / "out", take=Shutter(fail=[f"s_000{index}" for index in range(1, 5)]))
    assert [row["status"][:6] for row in manifest(tmp_path / "out")] == ["done", "failed", "failed", "failed"]


def test_the_manifest_holds_name_values_files_and_status(tmp_path):
    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100], "lens.f_number": ["f/2", "f/4"]}})
    run_sweep(sweep, tmp_path / "out", take=Shutter())
    row = manifest(tmp_path / "out")[1]
    assert float(row.pop("seconds")) >= 0
    assert row == {
        "index": "1", "name": "s_0001", "exposure.iso": "100", "lens.f_number": "f/4", "dng": "s_0001.dng",
        "truth": "s_0001.truth.exr", "sidecar": "s_0001.json", "status": "done",
    }  # fmt: skip


def test_any_map_may_run_the_points(tmp_path):
    def backwards(function, points):
        return [function(point) for point in reversed(list(points))]

    shutter = Shutter()
    run_sweep(read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200]}}), tmp_path / "out", take=shutter, map=backwards)
    assert shutter.taken == ["s_0001", "s_0000"]


def test_the_settings_of_a_point_give_its_shot_again(tmp_path):
    from simulator.config import load_shot

    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 200]}})
    run_sweep(sweep, tmp_path / "out", take=Shutter())
    assert load_shot(tmp_path / "out" / "s_0001.yaml").resolved == sweep[1].shot().resolved


def test_points_that_share_their_light_follow_each_other_and_the_manifest_keeps_the_order(tmp_path):
    vary = {"exposure.iso": [100, 200, 400], "lens.f_number": ["f/2", "f/4"], "seeds.frame": [1, 2]}
    sweep = read_sweep(tmp_path, {"vary": vary})
    shutter = Shutter()
    rows = run_sweep(sweep, tmp_path / "out", take=shutter)
    assert [row.index for row in rows] == list(range(12))
    assert [row["name"] for row in manifest(tmp_path / "out")] == [point.name for point in sweep]
    taken = [sweep[int(name[-4:])] for name in shutter.taken]
    assert sorted(point.index for point in taken) == list(range(12))
    assert [point.values["lens.f_number"] for point in taken] == ["f/2"] * 6 + ["f/4"] * 6
    zipped = read_sweep(tmp_path, {"mode": "zip", "vary": {"exposure.iso": [100, 200], "lens.f_number": ["f/2", "f/4"]}})
    assert [point.index for point in zipped.by_light()] == [0, 1]


def test_the_points_of_a_sweep_have_the_files_of_shots_taken_alone(tmp_path):
    camera = "{base: sony_a7s2, window: {x: 2000, y: 1400, width: 64, height: 48}}"
    text = SHOT.replace("focus_distance: 2 m", "focus_distance: 1.9 m").replace("camera: sony_a7s2", f"camera: {camera}")
    sweep = read_sweep(tmp_path, {"vary": {"exposure.iso": [100, 1600], "lens.f_number": ["f/2", "f/4"]}}, text)
    cache = LightCache()
    run_sweep(sweep, tmp_path / "shared", take=partial(take, cache=cache))
    assert cache.reused >= len(sweep)  # plan and light of the second ISO, at each aperture
    run_sweep(sweep, tmp_path / "alone", take=take)
    for end in ("dng", "truth.exr", "json"):
        for point in sweep:
            shared, alone = (tmp_path / folder / f"{point.name}.{end}" for folder in ("shared", "alone"))
            assert shared.read_bytes() == alone.read_bytes()


def test_a_sweep_that_varies_nothing_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match="varies nothing"):
        read_sweep(tmp_path, {"mode": "zip"})
