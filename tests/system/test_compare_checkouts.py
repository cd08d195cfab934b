"""The comparisons of two checkouts see what differs, and leave out no more than they say."""

import json

import numpy as np
import pytest
from checkouts.compare_results import Change, changes
from checkouts.items import items
from checkouts.records import array_digest, differences, file_record, folder_record, has_failed, plain, printed
from measuring.record import SHAPE
from measuring.results import keep, kept_of, load, numbers_of

from simulator.raw.raw_format import RawFormat

SIDECAR = {"shot": {"iso": 100}, "plan": ["blur: kept"], "versions": {"photosite": "1"}, "notes": [], "seeds": {"frame": 1}}


def of_json(folder, checkout="/a", **changed):
    path = folder / "a.json"
    path.write_text(json.dumps(SIDECAR | changed), encoding="utf-8")
    return file_record(path, checkout)


@pytest.mark.parametrize(
    ("changed", "equal"),
    [
        ({"versions": {"photosite": "2"}}, True),
        ({"plan": ["blur: left out"]}, True),
        ({"seeds": {"frame": 2}}, False),
        ({"seeds": {"frame": 1.0}}, False),
        ({"notes": ["depth ends within 1 mm"]}, False),
        ({"shot": {"iso": 100, "plan": 1}}, False),
        ({"device": "a"}, False),
    ],
)
def test_a_sidecar_differs_in_all_but_versions_and_plan(tmp_path, changed, equal):
    old, new = of_json(tmp_path)[0], of_json(tmp_path, **changed)[0]
    assert (list(differences(old, new)) == []) == equal


def test_the_plan_is_returned_apart(tmp_path):
    assert of_json(tmp_path)[1] == SIDECAR["plan"]


def test_another_json_file_keeps_its_versions(tmp_path):
    for version in ("1", "2"):
        (tmp_path / f"{version}.json").write_text(json.dumps({"versions": version, "plan": 1}), encoding="utf-8")
    old, new = (file_record(tmp_path / f"{version}.json", "/a")[0] for version in ("1", "2"))
    assert list(differences(old, new)) == ["versions: 1 | 2"]


def test_the_checkout_is_masked_as_a_whole_path_only(tmp_path):
    old = of_json(tmp_path, "/checkouts/old", shot={"file": "/checkouts/old/configs/a.yaml", "work": "/checkouts/old-2/b"})[0]
    new = of_json(tmp_path, "/tmp/new", shot={"file": "/tmp/new/configs/a.yaml", "work": "/checkouts/old-2/b"})[0]
    assert old == new and old["shot"] == {"file": "<checkout>/configs/a.yaml", "work": "/checkouts/old-2/b"}


def test_a_sweep_may_take_longer_but_not_fail(tmp_path):
    def rows(seconds, status):
        (tmp_path / "manifest.csv").write_text(f"index,seconds,status\n0,{seconds},{status}\n", encoding="utf-8")
        return file_record(tmp_path / "manifest.csv", "/a")[0]

    assert rows(0.1, "done") == rows(2.5, "done") != rows(0.1, "failed: no light")


def test_other_files_are_compared_byte_by_byte_and_by_place(tmp_path):
    for name in ("old", "new"):
        (tmp_path / name / "frames").mkdir(parents=True)
        (tmp_path / name / "frames" / "a.dng").write_bytes(b"code 1")
    records = [folder_record(tmp_path / name, "/a")[0] for name in ("old", "new")]
    assert records[0] == records[1] and list(records[0]) == ["frames/a.dng"]
    (tmp_path / "new" / "frames" / "a.dng").write_bytes(b"code 2")
    (tmp_path / "new" / "b.exr").write_bytes(b"")
    lines = list(differences(records[0], folder_record(tmp_path / "new", "/a")[0]))
    assert [line.split(":")[0] for line in lines] == ["frames/a.dng", "b.exr"] and lines[1].endswith("only in NEW")


def test_an_array_is_its_type_shape_and_bits():
    array = np.array([[0.0, 1.0], [np.nan, 2.0]], np.float32)
    others = (array.T, array.ravel(), array.astype(np.float64), np.where(array == 0, np.float32(-0.0), array))
    assert array_digest(array) == array_digest(array.copy(order="F"))
    assert array_digest(array) not in {array_digest(other) for other in others}


def test_plain_data_keeps_the_last_bit():
    assert plain({"a": (0.1,)}) != plain({"a": (np.nextafter(0.1, 1),)})
    assert plain(np.float32(0.1)) == plain(float(np.float32(0.1)))
    assert plain(RawFormat())["orientation"] == 1


def test_printed_text_loses_the_time_of_a_bar_and_no_number():
    text = "sweep 0:00:12, 1/200 s of /checkouts/old/a.yaml"
    assert printed(text, "/checkouts/old") == "sweep <time>, 1/200 s of <checkout>/a.yaml"


def test_a_message_loses_the_address_of_an_object_and_no_number():
    assert printed("device at 0x55aa394e0500, ISO 100", "/a") == "device at <address>, ISO 100"


@pytest.mark.parametrize(("error", "status", "failed"), [(None, 0, False), (None, 1, True), ("KeyError: 1", 0, True)])
def test_an_item_fails_by_its_error_or_by_a_command(error, status, failed):
    assert has_failed({"error": error, "values": {"0 photosite simulate": {"status": status}, "dn": "uint16"}}) == failed


def test_every_item_has_a_name_of_its_own_and_something_to_do(tmp_path):
    made = items(tmp_path, ["configs/shots/a.yaml"], ["ideal"], ["configs/datasets/b.yaml"])
    names = [item.name for item in made]
    assert len(set(names)) == len(names) >= 100
    assert all(bool(item.document) + bool(item.file) + bool(item.commands) == 1 for item in made)
    assert {"camera_ideal", "file_a", "dataset_file_b"} <= set(names)


def record_of(section="motion", changed=False, **row):
    ours = {"case": "one picture", "name": "Photosite, swept, 0.1 σ", "cpu_s": 0.2, "error": 0.05} | row
    peer = {"case": "one picture", "name": "NumPy slices", "cpu_s": 0.1, "error": 0.5}
    commit = {"hash": "0123456789abcdef", "date": 1000, "is_changed": changed}
    return {"shape": SHAPE, "section": section, "rows": [ours, peer], "commit": commit, "size": "quick"}


def test_numbers_of_a_commit_are_kept_and_read_back(tmp_path):
    """Of Photosite alone; sections that are measured later join them."""
    first, second = record_of(), record_of("psf", name="Photosite, 0.1 σ, 'core'", error=0.0)
    path = keep([first], tmp_path)
    assert keep([second], tmp_path) == path and kept_of(path.parent, "0123456789") == [path]
    numbers = load(path)
    assert numbers == numbers_of(first) | numbers_of(second)
    assert numbers["motion.time"] == {"one picture: Photosite, swept, 0.1 σ": 0.2}
    assert numbers["psf.error"] == {"one picture: Photosite, 0.1 σ, 'core'": 0.0}


def test_files_that_differ_from_their_commit_are_not_kept(tmp_path):
    assert keep([record_of(changed=True)], tmp_path) is None and not list(tmp_path.iterdir())


def test_kept_results_have_the_columns_of_airspeed_velocity(tmp_path):
    data = json.loads(keep([record_of()], tmp_path).read_text(encoding="utf-8"))
    assert data["version"] == 2 and data["result_columns"] == ["result", "params", "version"]
    result, params, _ = data["results"]["motion.error"]
    assert result == [0.05] and params == [["'one picture: Photosite, swept, 0.1 σ'"]]
    known = json.loads((tmp_path / "benchmarks.json").read_text(encoding="utf-8"))
    assert known["motion.time"]["type"] == "time" and known["motion.error"]["type"] == "track"


@pytest.mark.parametrize(
    ("benchmark", "old", "new", "worse"),
    [
        ("psf.time", (1.0, 1.1), (1.15, 1.4), True),
        ("psf.time", (1.0, 1.2), (1.15, 1.4), False),  # as slow was a round before
        ("psf.time", (1e-4, 1e-4), (3e-4, 3e-4), False),  # of no account
        ("psf.time", (1.0, 1.0), (0.5, 0.5), False),
        ("psf.error", (0.1, 0.1), (0.11, 0.11), True),
        ("psf.error", (0.0, 0.0), (0.01, 0.01), True),
        ("psf.error", (1e-5, 1e-5), (9e-4, 9e-4), False),  # of no account
        ("psf.error", (0.1, 0.1), (0.01, 0.01), False),
    ],
)
def test_slower_than_every_round_before_or_less_accurate_is_worse(benchmark, old, new, worse):
    assert Change(benchmark, "setting", old, new).is_worse == worse


def test_settings_of_one_side_alone_are_named():
    old, new = [{"psf.time": {"a": 1.0, "b": 1.0}}] * 2, [{"psf.time": {"b": 2.0, "c": 1.0}}] * 2
    found, lonely = changes(old, new)
    assert found == [Change("psf.time", "b", (1.0, 1.0), (2.0, 2.0))]
    assert lonely == ["psf.time a: only in OLD", "psf.time c: only in NEW"]
