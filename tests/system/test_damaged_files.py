"""Of damaged files nothing but PhotositeError gets out, whatever library reads them."""

import json
import os
import sys

import numpy as np
import pytest
from helpers.bad_input import SHOT
from helpers.damaged_files import CAMERA, ROLES, damaged

from data_gen.storage.manifest import MANIFEST
from data_gen.storage.reading import SampleFolder
from simulator.command_line.main import main
from simulator.config import load_camera, load_shot, load_sweep
from simulator.errors import PhotositeError

QUICK, MANY = 25, 600  # damaged files of each role


def read_damaged(folder, name, count, seed):
    """Read a role's file `count` times, each time with other damage; return how many were refused."""
    role, refused = ROLES[name], 0
    path = folder / role.name
    role.make(path)
    content = path.read_bytes()
    role.read(path)
    for number in range(count):
        spoilt = damaged(content, np.random.default_rng([seed, number]))
        path.write_bytes(spoilt)
        try:
            role.read(path)
        except PhotositeError as error:
            assert f"{error}".isprintable()
            refused += 1
        except Exception as error:
            error.add_note(f"{name}: file {number} of seed {seed}")
            raise
    return refused


@pytest.mark.parametrize("name", ROLES)
def test_a_damaged_file_is_refused_with_a_message_or_read(tmp_path, name):
    assert read_damaged(tmp_path, name, QUICK, 1) > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ROLES)
def test_many_damaged_files_are_refused_with_a_message_or_read(tmp_path, name):
    assert read_damaged(tmp_path, name, MANY, 2) > MANY / 20


def made(folder, name):
    """Write the good file of a role; return its path and bytes."""
    path = folder / ROLES[name].name
    ROLES[name].make(path)
    return path, path.read_bytes()


@pytest.mark.parametrize("name", [name for name in ROLES if ROLES[name].name.endswith(".exr")])
def test_names_in_a_picture_that_are_no_text_are_one_message(tmp_path, name):
    """OpenImageIO says which type of the header is wrong, in bytes that are not UTF-8."""
    path, content = made(tmp_path, name)
    path.write_bytes(content.replace(b"channels\0chlist\0", b"channels\0chl\xff\xfet\0", 1))
    with pytest.raises(PhotositeError, match=rf"{path.name}: cannot be read \(text in it is damaged\)"):
        ROLES[name].read(path)


@pytest.mark.parametrize("name", [name for name in ROLES if ROLES[name].name.endswith(".npy")])
def test_an_array_whose_header_does_not_end_is_one_message(tmp_path, name):
    path, content = made(tmp_path, name)
    path.write_bytes(content.replace(b"}", b"(", 1))
    with pytest.raises(PhotositeError, match=rf"{path.name}: cannot be read \("):
        ROLES[name].read(path)


@pytest.mark.parametrize("name", ["image, npy", "PSF, npy", "wavelengths, npy"])
def test_an_array_that_states_more_than_the_memory_is_one_message(tmp_path, name):
    path, content = made(tmp_path, name)
    shape = content[content.index(b"(") : content.index(b")") + 1]
    path.write_bytes(content.replace(shape, b"(" + b"9" * 15 + b",)").replace(b" " * 16, b"", 1))
    with pytest.raises(PhotositeError, match=rf"{path.name}: "):
        ROLES[name].read(path)


@pytest.mark.parametrize("options", [["--json"], []])
def test_a_raw_file_whose_camera_is_no_text_is_inspected(tmp_path, capsys, options):
    path, content = made(tmp_path, "raw file")
    path.write_bytes(content.replace(b"Test Body", b"T\xe9st\xff\xff\xff\xff\xff"))
    with pytest.raises(SystemExit) as ended:
        main(["inspect", f"{path}", *options])
    out = capsys.readouterr().out
    assert not ended.value.code and r"T\udce9st\udcff" in out
    if options:
        assert json.loads(out)["model"] == "T\udce9st" + 5 * "\udcff"


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are text there")
def test_a_file_whose_name_is_no_text_is_one_message(tmp_path, capsys):
    path, _ = made(tmp_path, "raw file")
    other = os.fsdecode(os.fsencode(tmp_path) + b"/\xe9t\xff.dng")
    path.rename(other)
    with pytest.raises(SystemExit, match="1"):
        main(["inspect", other])
    assert r"\udce9t\udcff.dng: cannot be read (its path is no UTF-8 text: rename it)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("values", "rule"),
    [
        ("{from: 1/60 foo, to: 1/30 s, steps: 3}", "`foo` is no unit known here"),
        ("{from: 1/60 s, to: 1/30 foo, steps: 3}", "`foo` is no unit known here"),
        ("{from: 1 foo, to: 2 foo, steps: 3}", "`foo` is no unit known here"),
        ("[1/60 s, 1/30 foo]", "`foo` is no unit known here"),
        ("{from: 1 s, to: 2 mm, steps: 3}", "is a length"),
    ],
)
def test_an_unknown_unit_in_a_sweep_is_named_with_its_line(tmp_path, values, rule):
    path, _ = made(tmp_path, "shot, YAML")
    path.write_text(SHOT + f"sweep:\n  vary:\n    exposure.time: {values}\n")
    line = SHOT.count("\n") + 3
    with pytest.raises(PhotositeError, match=rf"s\.yaml:{line}.*exposure\.time.*{rule}"):
        load_sweep(path)


@pytest.mark.parametrize("base", ["base.yaml", None])
def test_an_iso_may_be_quoted_as_json_has_it(tmp_path, base):
    """Beside a base, too; an error in its line names the line."""
    (tmp_path / "base.yaml").write_text(CAMERA)
    text = CAMERA if base is None else f"base: ./{base}\n"
    lines = '  "100": {gain: 0.3 DN/e-, read_noise: 2 DN}\n'
    written = tmp_path / "b.yaml"
    if base is None:
        text = text.replace("  100: {gain: 0.1 DN/e-, read_noise: 2 DN}\n", lines)
    else:
        text += "iso_table:\n" + lines
    written.write_text(text)
    assert load_camera(f"{written}").iso_table[100].gain_dn_per_e == 0.3
    written.write_text(text.replace("0.3 DN/e-", "-1 DN/e-"))
    line = text[: text.index('"100"')].count("\n") + 1
    with pytest.raises(PhotositeError, match=rf"b\.yaml:{line}: camera\.iso_table\.100\.gain = -1 DN/e-"):
        load_camera(f"{written}")


def test_one_key_in_two_spellings_is_written_twice(tmp_path):
    (tmp_path / "c.yaml").write_text(CAMERA.replace('"200"', '"100"'))
    with pytest.raises(PhotositeError, match=r"c\.yaml:13: iso_table\.100 is written twice"):
        load_camera(f"{tmp_path / 'c.yaml'}")


@pytest.mark.parametrize("change", [{"first": "a"}, {"name": 3}, {"bytes": None}])
def test_a_manifest_with_wrong_types_is_one_message(tmp_path, change):
    path, _ = made(tmp_path, "data set, manifest")
    content = json.loads(path.read_text())
    content["shards"][0] |= change
    path.write_text(json.dumps(content))
    with pytest.raises(PhotositeError, match=rf"{MANIFEST}: cannot be read"):
        SampleFolder(tmp_path)


def test_a_shot_that_is_nested_without_end_is_one_message(tmp_path):
    (tmp_path / "s.yaml").write_text("scene: " + "[" * 5000)
    with pytest.raises(PhotositeError, match="nested too deeply|broken YAML"):
        load_shot(tmp_path / "s.yaml")
