"""The comparison of two checkouts sees what differs, and leaves out no more than it says."""

import json

import numpy as np
import pytest
from checkouts.items import items, timed_documents
from checkouts.records import array_digest, differences, file_record, folder_record, has_failed, plain, printed

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
    assert len(timed_documents(tmp_path)) >= 7
