import dataclasses
import json
import math
import time
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO
import pytest
import rawpy
from helpers.raw_frame import random_frame

from simulator.errors import PhotositeError
from simulator.raw import save as save_module
from simulator.raw.image_files import write_picture
from simulator.raw.save import files_of, save, sidecar_text
from simulator.raw.truth_exr import read_twin, write_twin


def test_a_truth_exr_gives_back_every_bit_of_both_planes(tmp_path):
    raw = random_frame(97, 131)
    # Values whose last bits half floats or 16-bit codes would lose.
    raw = dataclasses.replace(raw, mean_electrons=(raw.mean_electrons * np.float32(math.pi)) + np.float32(1e-3))
    write_twin(raw, tmp_path / "a.truth.exr")
    twin = read_twin(tmp_path / "a.truth.exr")
    assert set(twin) == {"electrons.mean", "dn.noise_free"}
    for name, plane in (("electrons.mean", raw.mean_electrons), ("dn.noise_free", raw.noise_free_dn)):
        assert twin[name].dtype == np.float32
        np.testing.assert_array_equal(twin[name], plane)


def test_a_truth_exr_has_iso_levels_and_gain(tmp_path):
    write_twin(random_frame(gain_dn_per_e=0.25), tmp_path / "a.exr")
    spec = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert spec.getattribute("Software").startswith("Photosite ")
    assert spec.getattribute("photosite:iso") == 400
    assert spec.getattribute("photosite:cfa") == "RGGB"
    assert spec.getattribute("photosite:black_level_dn") == 511
    assert spec.getattribute("photosite:white_level_dn") == 16383
    assert spec.getattribute("photosite:gain_dn_per_e") == 0.25


@pytest.mark.parametrize(("iso", "told"), [(2**31 - 1, 2**31 - 1), (2**31, None)])
@pytest.mark.parametrize("truth", [{}, {"depth": np.ones((96, 128), np.float32)}], ids=["own", "library"])
def test_an_iso_that_exr_has_no_whole_number_for_is_left_out(tmp_path, iso, told, truth):
    """Depth is compressed, so that OpenImageIO writes the file; without it the bytes are laid out here."""
    write_twin(random_frame(iso=iso, truth=truth), tmp_path / "a.exr")
    spec = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert spec.getattribute("photosite:iso") == told and spec.getattribute("photosite:cfa") == "RGGB"


def with_truth(cfa="RGGB"):
    """A frame with random numbers in every part of the truth."""
    raw = random_frame(97, 131, cfa)
    random = np.random.default_rng(5)
    planes = {name: random.uniform(0.1, 9.0, (97, 131)).astype(np.float32) for name in ("variance", "depth", "blur")}
    planes["depth"][3, 4] = math.inf
    rgb = random.normal(0.5, 0.2, (97, 131, 1 if cfa == "MONO" else 3)).astype(np.float32)
    return dataclasses.replace(raw, truth=planes | {"rgb": rgb})


CHANNELS = {"electrons.mean": "e-", "dn.noise_free": "DN", "dn.variance": "DN^2", "Z": "m", "blur.radius": "px"}


@pytest.mark.parametrize(("cfa", "colours"), [("RGGB", "RGB"), ("MONO", "Y")])
def test_every_part_of_the_truth_is_read_back_by_openexr_itself_and_by_us(tmp_path, cfa, colours):
    raw = with_truth(cfa)
    write_twin(raw, tmp_path / "a.truth.exr")
    file = OpenEXR.File(str(tmp_path / "a.truth.exr"), separate_channels=True)
    assert [part.name() for part in file.parts] == ["electrons", "noise_free", "variance", "depth", "blur", "rgb"]
    units = {name: part.header["photosite:unit"] for part in file.parts for name in part.channels}
    assert units == CHANNELS | dict.fromkeys(colours, "1")
    channels = {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}
    ours = read_twin(tmp_path / "a.truth.exr")
    planes = [raw.mean_electrons, raw.noise_free_dn, raw.truth["variance"], raw.truth["depth"], raw.truth["blur"]]
    expected = dict(zip(CHANNELS, planes, strict=True)) | dict(zip(colours, np.moveaxis(raw.truth["rgb"], 2, 0), strict=True))
    assert channels.keys() == ours.keys() == expected.keys()
    for name, plane in expected.items():
        np.testing.assert_array_equal(channels[name], plane)
        np.testing.assert_array_equal(ours[name], plane)


@pytest.mark.parametrize("height", [22, 64, 65])
def test_tiles_are_as_wide_as_the_frame_and_no_higher(tmp_path, height):
    raw = random_frame(height, 131)
    write_twin(raw, tmp_path / "a.exr")
    spec = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert (spec.tile_width, spec.tile_height) == (131, min(height, 64))
    np.testing.assert_array_equal(read_twin(tmp_path / "a.exr")["dn.noise_free"], raw.noise_free_dn)


def test_a_truth_exr_whose_gain_is_not_known_claims_none(tmp_path):
    write_twin(random_frame(gain_dn_per_e=0.0), tmp_path / "a.exr")
    assert OpenImageIO.ImageInput.open(str(tmp_path / "a.exr")).spec().getattribute("photosite:gain_dn_per_e") is None


def test_two_runs_of_one_shot_give_the_same_bytes(tmp_path, monkeypatch):
    raw = random_frame(resolved={"camera": "a"})
    first = save(raw, tmp_path / "first")
    time.sleep(1.1)  # a clock in a header counts in seconds
    second = save(raw, tmp_path / "second")
    for one, other in zip(dataclasses.astuple(first), dataclasses.astuple(second), strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_a_truth_exr_of_another_shape_than_the_mosaic_is_refused(tmp_path):
    raw = random_frame(mean_electrons=np.zeros((5, 5), np.float32))
    with pytest.raises(PhotositeError, match="electrons.mean is .5, 5. and the mosaic .96, 128."):
        write_twin(raw, tmp_path / "a.exr")
    assert list(tmp_path.iterdir()) == []


def test_reading_what_is_no_truth_exr_is_one_clear_error(tmp_path):
    with pytest.raises(PhotositeError, match=r"none\.exr: no such file"):
        read_twin(tmp_path / "none.exr")
    (tmp_path / "text.exr").write_text("not a picture")
    with pytest.raises(PhotositeError, match=r"text\.exr: not a picture file"):
        read_twin(tmp_path / "text.exr")
    write_picture(tmp_path / "rgb.exr", np.zeros((4, 4, 3), np.float32))
    with pytest.raises(PhotositeError, match=r"rgb\.exr: not a truth twin: it has no channel dn\.noise_free"):
        read_twin(tmp_path / "rgb.exr")


def test_a_truncated_truth_exr_is_one_clear_error(tmp_path):
    write_twin(random_frame(), tmp_path / "a.exr")
    content = (tmp_path / "a.exr").read_bytes()
    for length in (len(content) - 1, len(content) // 2, 1000, 200, 10, 0):
        (tmp_path / "cut.exr").write_bytes(content[:length])
        with pytest.raises(PhotositeError, match=r"cut\.exr: (damaged|not a picture)"):
            read_twin(tmp_path / "cut.exr")


def test_a_set_is_a_raw_file_its_truth_exr_and_its_settings(tmp_path):
    raw = random_frame(name="iso400_01", resolved={"b": 1, "a": {"iso": np.int64(400)}})
    files = save(raw, tmp_path / "out")
    assert [path.name for path in dataclasses.astuple(files)] == ["iso400_01.dng", "iso400_01.truth.exr", "iso400_01.json"]
    assert sorted((tmp_path / "out").iterdir()) == sorted(dataclasses.astuple(files))
    with rawpy.imread(str(files.dng)) as frame:
        np.testing.assert_array_equal(frame.raw_image_visible, raw.dn)
    np.testing.assert_array_equal(read_twin(files.twin)["dn.noise_free"], raw.noise_free_dn)
    assert json.loads(files.sidecar.read_text()) == {"a": {"iso": 400}, "b": 1}


@pytest.mark.parametrize(("breaks", "file"), [("write_pieces", "frame.dng"), ("put_parts", "frame.truth.exr")])
def test_a_set_that_breaks_off_leaves_the_old_set_or_none(tmp_path, monkeypatch, breaks, file):
    files = save(random_frame(), tmp_path / "old")
    before = {path: path.read_bytes() for path in dataclasses.astuple(files)}

    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(save_module, breaks, fail)
    for folder in ("old", "new"):
        with pytest.raises(PhotositeError, match=f"{folder}/{file}: cannot be written: No space left"):
            save(random_frame(), tmp_path / folder)
    assert {path: path.read_bytes() for path in (tmp_path / "old").iterdir()} == before
    assert not list((tmp_path / "new").iterdir())


def test_the_mosaic_is_on_its_way_to_the_disk_before_the_truth_is_computed(tmp_path):
    found = []

    def truth() -> np.ndarray:
        found.extend(path.stat().st_size for path in tmp_path.glob("*/new.dng"))
        return np.zeros((96, 128), np.float32)

    save(random_frame(mean_electrons=truth), tmp_path)
    assert found and found[0] >= 2 * 96 * 128


def test_settings_are_plain_sorted_json_whatever_numbers_they_hold():
    settings = {
        "z": np.float32(0.5),
        "a": np.array([[1, 2], [3, 4]]),
        "m": {400: (np.int16(-1), np.bool_(True)), "path": Path("a/b")},
        "far": math.inf,
        "also": np.float64("nan"),
        "name": "Fürst",
        "none": None,
    }
    text = sidecar_text(random_frame(resolved=settings))

    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    assert json.loads(text, parse_constant=refuse) == {
        "z": 0.5,
        "a": [[1, 2], [3, 4]],
        "m": {"400": [-1, True], "path": "a/b"},
        "far": "inf",
        "also": "nan",
        "name": "Fürst",
        "none": None,
    }
    assert list(json.loads(text)) == sorted(settings)
    assert text.startswith('{\n  "a"')


def test_settings_json_has_no_form_for_are_refused_before_anything_is_written(tmp_path):
    with pytest.raises(PhotositeError, match="frame: settings cannot be written as JSON: .* is a object"):
        save(random_frame(resolved={"a": object()}), tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["", "..", "a/b", "../a", "a\\b", "a\0b"])
def test_a_name_that_leaves_the_folder_is_refused(tmp_path, name):
    with pytest.raises(PhotositeError, match="shot.name = .*plain file name"):
        files_of(name, tmp_path)


def test_without_truth_no_twin_is_written_or_computed_and_an_old_one_goes(tmp_path):
    def fail() -> np.ndarray:
        raise AssertionError("the truth was computed")

    old = save(random_frame(), tmp_path)
    assert old.there() == [old.dng, old.twin, old.sidecar]
    files = save(random_frame(mean_electrons=fail, noise_free_dn=fail), tmp_path, truth=False)
    assert files.there() == [old.dng, old.sidecar]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frame.dng", "frame.json"]
