"""A shot file becomes a Shot, or one message with file, line, key, value and fix."""

import json
import math
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.tiny_shot import CAMERA, CURVES, SHOT, tiny_folder, write_shot
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simulator.config import dump_yaml, load_shot
from simulator.errors import PhotositeError
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.shutter import CurtainShutter, FirstCurtainShutter, GlobalShutter, LeafShutter, RollingShutter


@pytest.fixture
def folder(tmp_path):
    return tiny_folder(tmp_path)


def load_and_get_message(folder: Path, text: str = SHOT, overrides=()) -> str:
    with pytest.raises(PhotositeError) as caught:
        load_shot(write_shot(folder, text), overrides)
    return str(caught.value)


def test_every_number_arrives_in_the_unit_of_its_field(folder):
    shot = load_shot(write_shot(folder))
    assert (shot.lens.focal_length_mm, shot.lens.f_number, shot.lens.focus_distance_m) == (50.0, 4.0, 2.0)
    assert (shot.exposure.time_s, shot.exposure.iso) == (1 / 125, 100)
    assert shot.scene.luminance_cd_m2 == 100.0
    camera = shot.camera
    assert (camera.width_px, camera.height_px, camera.pixel_pitch_um, camera.cfa) == (64, 48, 5.0, "RGGB")
    assert camera.iso_table[200].gain_dn_per_e == 1.0 and camera.iso_table[200].read_noise_dn == 3.0
    assert camera.stages["full_well"].capacity_e == 5000.0
    assert list(camera.response.wavelengths_nm) == [400.0, 500.0, 600.0, 700.0]
    np.testing.assert_array_equal(camera.response.quantum_efficiency[1], [0.1, 0.45, 0.05])
    assert shot.name == "shot"


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("50 mm", "50", 5, "lens.focal_length = 50: has no unit; write a length such as 50 mm"),
        ("50 mm", "50 s", 5, "lens.focal_length = 50 s: is a time; a length such as 50 mm is wanted"),
        ("50 mm", "", 5, "lens.focal_length is empty"),
        ("focal_length", "focal_lenght", 5, "lens.focal_lenght: unknown key; did you mean `focal_length`?"),
        ("  f_number: f/4\n", "", 4, "lens.f_number is missing: N = f / pupil diameter"),
        ("  time: 1/125 s\n", "", 8, "write for example `time: 1/125 s`"),
        ("exposure:\n  time: 1/125 s\n  iso: 100\n", "", None, "exposure is missing"),
        ("f/4", "f/0.4", 6, "lens.f_number = f/0.4: no lens in air is faster than f/0.5"),
        ("2 m", "2 cm", 7, "lens.focus_distance = 0.02 m"),
        ("1/125 s", "0 s", 9, "the shutter must open"),
        ("1/125 s", "12:30", 9, "exposure.time = 12:30"),
        ("iso: 100", "shutter: rolling", 10, "exposure.shutter = rolling: give a section of `key: value` lines"),
        ("camera: tiny", "camera: {base: sony_a7s2, window: [64, 48]}", 11, "lines; its keys: x, y, width, height"),
        ("camera: tiny", "camera: {base: sony_a7s2, window: {width: 4, height: 4}}", 11, "camera.window.x is missing; so is y"),
        ("iso: 100", "shutter: {readout_time: -1 s}", 10, "exposure.shutter.readout_time = -1 s: give a time of 0 s or more"),
        ("iso: 100", "shutter: {readout_time: 3}", 10, "exposure.shutter.readout_time = 3: has no unit"),
        ("iso: 100", "shutter: {travel: top_to_bottom}", 10, "exposure.shutter.travel_time is missing"),
        ("iso: 100", "flicker: {frequency: 100 Hz}", 10, "exposure.flicker.modulation is missing"),
        ("iso: 100", "flash: {guide_number: 10 m}", 10, "exposure.flash.length = 0 s: a pulse takes time"),
        ("  time: 1/125 s\n", "", 8, "exposure.time: the shutter must open and close, so that mode manual needs a time; write"),
        (
            "iso: 100",
            "iso: 100\n  shutter: {travel_time: 3 ms, readout_time: 9 ms}",
            11,
            "exposure.shutter.readout_time: is of another kind (rolling shutter or global shutter) than the keys beside it "
            "(curtain shutter); keep one kind: curtain shutter: acceleration, distance, travel, travel_time; rolling shutter: ",
        ),
        ("iso: 100", "iso: 1e2", 10, "exposure.iso = 100.0: give a whole number"),
        (
            "iso: 100",
            "iso: 250",
            10,
            "exposure.iso = 250: the Maker Tiny was not measured there, but at 100 to 200; give an ISO",
        ),
        ("iso: 100", "iso: 100\n  iso: 200", 11, "exposure.iso is written twice (first at "),
        ("f/4", "f/4\n  cos4: no", 7, "lens.cos4 = no: write true or false"),
        ("f/4", "f/4\n  irradiance: thinlens", 7, "did you mean `thin_lens`?"),
        ("f/4", "f/4\n  transmittance: 1e400", 7, "lens.transmittance = inf: give a finite number"),
        ("flat_field", "flatfield", 2, "did you mean `flat_field`?"),
        ("chart:", "chrt:", 2, "did you mean `chart`?"),
        ("chart: flat_field", "chart: flat_field\n  image: a.png", 3, "holds chart and image; keep one"),
        ("camera: tiny", "camera: tony", 11, "camera = tony: no such file in configs/cameras"),
        ("camera: tiny", "camera: none/tiny.yaml", 11, "relative to the file that names it"),
        ("camera: tiny", "camera: ~nosuchuser/a.yaml", 11, "camera = ~nosuchuser/a.yaml: begins with the home of a user who"),
        ("chart: flat_field", "image: ~nosuchuser/a.exr", 2, "scene.image = ~nosuchuser/a.exr: begins with the home of a user"),
        ("camera: tiny", "camera: 7", 11, "camera = 7: give a section"),
        ("camera: tiny", "camera: {base: 7}", 11, "camera.base = 7"),
        ("scene:", "seeds: {frame: -1}\nscene:", 1, "seeds.frame = -1"),
        ("scene:", "name: a/b\nscene:", 1, "name = a/b"),
        ("50 mm", "[50 mm", 6, "broken YAML"),
        ("50 mm", "!!python/object/apply:os.getcwd []", 5, "the tag"),
        ("scene:", "? [1]\n: 2\nscene:", 1, "cannot be a key"),
    ],
)
def test_a_mistake_is_told_with_file_line_key_value_and_fix(folder, old, new, line, message):
    assert old in SHOT
    text = load_and_get_message(folder, SHOT.replace(old, new, 1))
    assert text.startswith(f"{folder / 'shot.yaml'}:{line}: " if line else f"{folder / 'shot.yaml'}: ")
    assert message in text
    assert "\n" not in text


def test_a_path_may_begin_with_the_home_of_the_user(folder, monkeypatch):
    monkeypatch.setenv("HOME", str(folder / "home"))
    text = SHOT.replace("chart: flat_field", "image: ~/a.exr")
    assert load_shot(write_shot(folder, text)).scene.image == folder / "home" / "a.exr"


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("width: 64", "width: 0", 3, "camera.width = 0"),
        ("5 um", "-5 um", 5, "camera.pixel_pitch = -5 um"),
        ("RGGB", "RGBG", 6, "camera.cfa = RGBG"),
        ("RGGB", "MONO", 6, "needs 1 value"),
        ("bit_depth: 12", "bit_depth: 20", None, "bit_depth = 20"),
        ("64 DN", "5000 DN", None, "black_level = 5000"),
        ("100: {gain: 0.5", "100: {gain: 0", 11, "camera.iso_table.100.gain = 0 DN/e-"),
        ("read_noise: 3 DN", "read_noise: 1 DN", 12, "camera.iso_table.200.read_noise = 1 DN: is below read_noise_after_gain"),
        ("  100: {gain", "  base: {gain", 11, "camera.iso_table.base"),
        ("full_well: {capacity: 5000 e-}", "full_wel: {capacity: 5000 e-}", 16, "did you mean `full_well`?"),
        ("full_well: {capacity: 5000 e-}", "full_well: {capacity: 5000 V}", 16, "camera.stages.full_well.capacity = 5000 V"),
        ("photon_shot_noise: {}", "photon_shot_noise:", 15, "camera.stages.photon_shot_noise is empty"),
        ("stages:", "window: {x: 1, y: 1, width: 64, height: 8}\nstages:", 14, "must lie within the sensor's 64 x 48"),
        ("curves.yaml", "curve", 9, "camera.response.file = curve: no such file in configs/responses"),
        ("{file: curves.yaml}", "curves", 9, "write `response: {file: curves}`"),
        ("make: Maker", "base: tiny.yaml\nmake: Maker", 1, "the camera is its own base"),
    ],
)
def test_a_mistake_in_a_camera_file_is_told_with_its_line_there(folder, old, new, line, message):
    assert old in CAMERA
    (folder / "tiny.yaml").write_text(CAMERA.replace(old, new, 1))
    text = load_and_get_message(folder)
    assert text.startswith(f"{folder / 'tiny.yaml'}:{line}: " if line else f"{folder / 'tiny.yaml'}:")
    assert message in text and "\n" not in text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.5", "1.5", "response.peak_quantum_efficiency = 1.5"),
        ("[0.1, 0, 0]", "[0.1, 0]", "same number of values"),
        ("[0.1, 0, 0]", "[-0.1, 0, 0]", "is not negative"),
        ("[0, 0, 1]", "[0, 0, 0.5]", "largest entry is 1"),
        ("step: 100 nm", "step: 0 nm", "step above 0 nm"),
    ],
)
def test_a_response_that_cannot_be_one_is_refused_in_its_own_file(folder, old, new, message):
    (folder / "curves.yaml").write_text(CURVES.replace(old, new, 1))
    text = load_and_get_message(folder)
    assert text.startswith(f"{folder / 'curves.yaml'}:") and message in text


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("lens.f_number=f/0.3", "lens.f_number = f/0.3"),
        ("lens.f_numbr=f/3", "did you mean `f_number`?"),
        ("lens.f_number", "write path=value"),
        ("=3", "write path=value"),
        ("lens..x=3", "no key"),
        ("lens.f_number.x=3", "is a value, not a section"),
        ("seeds=null", "nothing is removed"),
        ("lens.f_number=[", "broken YAML"),
        ("camera.window={x: 0, y: 0, width: 65, height: 1}", "camera.window"),
        ("camera=nosuch", "no such file in configs/cameras"),
    ],
)
def test_a_mistake_in_an_override_names_the_override(folder, override, message):
    text = load_and_get_message(folder, overrides=[override])
    assert text.startswith(f"--set {override}: ") and message in text


def test_overrides_reach_every_leaf(folder):
    overrides = [
        "lens.f_number=f/8",
        "exposure.iso=200",
        "seeds.frame=7",
        "camera.iso_table.200.gain=2 DN/e-",
        "camera.stages.full_well=null",
        "camera.stages.dark_current.rate=3 e-/s",
        "camera.response.peak_quantum_efficiency=0.25",
    ]
    shot = load_shot(write_shot(folder), overrides)
    assert shot.lens.f_number == 8.0 and shot.exposure.iso == 200 and shot.seeds.frame == 7
    assert shot.camera.iso_table[200].gain_dn_per_e == 2.0 and shot.camera.iso_table[200].read_noise_dn == 3.0
    assert sorted(shot.camera.stages) == ["dark_current", "photon_shot_noise"]
    assert shot.camera.response.quantum_efficiency.max() == 0.25
    by_mapping = load_shot(write_shot(folder), dict(pair.split("=") for pair in overrides[:1]) | {"exposure.iso": 200})
    assert by_mapping.lens.f_number == 8.0 and by_mapping.exposure.iso == 200


def test_a_camera_on_a_base_overlays_keys_and_null_removes(folder):
    camera = (
        "camera: {base: tiny.yaml, bit_depth: 14, iso_table: {merge: true, 100: {gain: 0.6 DN/e-}}, stages: {full_well: null}}"
    )
    shot = load_shot(write_shot(folder, SHOT.replace("camera: tiny", camera)))
    assert shot.camera.bit_depth == 14 and shot.camera.model == "Tiny"
    assert (shot.camera.iso_table[100].gain_dn_per_e, shot.camera.iso_table[100].read_noise_dn) == (0.6, 2.0)
    assert list(shot.camera.stages) == ["photon_shot_noise"]


TABLES = {
    "{200: {gain: 0.6 DN/e-, read_noise: 4 DN}}": {200: (0.6, 4.0, 0.0)},
    "{merge: false, 200: {gain: 0.6 DN/e-, read_noise: 4 DN}}": {200: (0.6, 4.0, 0.0)},
    '{"200": {gain: 0.6 DN/e-, read_noise: 4 DN}}': {200: (0.6, 4.0, 0.0)},
    "{merge: true, 200: {gain: 0.6 DN/e-}}": {100: (0.5, 2.0, 0.1), 200: (0.6, 3.0, 0.2)},
    "{merge: true, 400: {gain: 2 DN/e-, read_noise: 4 DN}}": {
        100: (0.5, 2.0, 0.1),
        200: (1.0, 3.0, 0.2),
        400: (2.0, 4.0, 0.0),
    },
    "{merge: true, 100: null}": {200: (1.0, 3.0, 0.2)},
    "{merge: true}": {100: (0.5, 2.0, 0.1), 200: (1.0, 3.0, 0.2)},
}


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("way", ["shot", "file", "--set"])
def test_a_table_replaces_that_of_the_base_unless_it_says_merge(folder, table, way):
    """Gain, read noise and row noise; in a shot, in a camera file whose base has a base, and set by an option."""
    rowed = CAMERA.replace("read_noise: 2 DN", "read_noise: 2 DN, row_noise: 0.1 DN")
    (folder / "tiny.yaml").write_text(rowed.replace("read_noise: 3 DN", "read_noise: 3 DN, row_noise: 0.2 DN"))
    camera, overrides = f"{{base: tiny.yaml, iso_table: {table}}}", []
    if way == "file":
        (folder / "middle.yaml").write_text(f"base: tiny.yaml\niso_table: {table}\n")
        (folder / "top.yaml").write_text("base: middle.yaml\nmodel: Top\n")
        camera = "top.yaml"
    elif way == "--set":
        camera, overrides = "tiny.yaml", [f"camera={{base: {folder}/tiny.yaml, iso_table: {table}}}"]
    text = SHOT.replace("camera: tiny", f"camera: {camera}").replace("iso: 100", f"iso: {min(TABLES[table])}")
    found = load_shot(write_shot(folder, text), overrides).camera.iso_table
    assert {iso: (line.gain_dn_per_e, line.read_noise_dn, line.row_noise_dn) for iso, line in found.items()} == TABLES[table]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("{400: {gain: 2 DN/e-}}", r"second\.yaml:3: camera\.iso_table\.400\.read_noise is missing"),
        ("{}", r"camera\.iso_table = \{\}: give at least one line"),
        ("{merge: 1, 400: {gain: 2 DN/e-}}", r"second\.yaml:3: merge = 1: write true, or leave it out"),
    ],
)
def test_a_table_beside_a_base_is_checked_as_any_other(folder, table, message):
    (folder / "second.yaml").write_text(f"base: tiny.yaml\nmodel: Two\niso_table: {table}\n")
    with pytest.raises(PhotositeError, match=message):
        load_shot(write_shot(folder, SHOT.replace("camera: tiny", "camera: second.yaml")))


@pytest.mark.parametrize("base", ["", "base: tiny.yaml\niso_table: {merge: true, 100: {gain: 1 DN/e-}}\n"])
def test_a_table_can_only_be_merged_with_one_below(folder, base):
    (folder / "tiny.yaml").write_text(CAMERA.replace("iso_table:\n", "iso_table:\n  merge: true\n"))
    (folder / "top.yaml").write_text(base or CAMERA.replace("iso_table:\n", "iso_table:\n  merge: true\n"))
    with pytest.raises(PhotositeError, match=r"camera\.iso_table\.merge: there is no iso_table below to merge it with"):
        load_shot(write_shot(folder, SHOT.replace("camera: tiny", "camera: top.yaml")))


def test_sources_of_a_table_go_with_it(folder):
    sources = "source: {iso_table.gain: measured, 'iso_table.read_noise, width': both, cfa: known}\n"
    (folder / "tiny.yaml").write_text(sources + CAMERA)
    for merges, left in (("", 2), ("merge: true, ", 3)):
        camera = f"{{base: tiny.yaml, iso_table: {{{merges}100: {{gain: 1 DN/e-, read_noise: 4 DN}}}}}}"
        shot = load_shot(write_shot(folder, SHOT.replace("camera: tiny", f"camera: {camera}")))
        assert len(shot.resolved["camera"]["source"]) == left


def test_another_camera_is_chosen_before_its_values_are_set(folder):
    (folder / "other.yaml").write_text(CAMERA.replace("Tiny", "Other"))
    shot = load_shot(write_shot(folder), ["camera.bit_depth=10", f"camera={folder}/other.yaml"])
    assert (shot.camera.model, shot.camera.bit_depth) == ("Other", 10)


def test_paths_start_from_the_file_that_names_them_and_overrides_from_here(folder, monkeypatch):
    text = SHOT.replace("chart: flat_field", "image: pictures/a.exr\n  depth: {image: z.npy}")
    shot = load_shot(write_shot(folder, text))
    assert shot.scene.image == folder / "pictures" / "a.exr" and shot.scene.depth_m.image == folder / "z.npy"
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert load_shot(write_shot(folder, text), ["scene.image=b.exr"]).scene.image == elsewhere / "b.exr"


@pytest.mark.parametrize("name", ["z.npy", "maps/depth_0001.exr", "0001.exr", f"{'long_' * 20}name.tiff"])
def test_a_file_name_in_place_of_a_distance_is_told_how_a_file_is_given(folder, name):
    picture = SHOT.replace("chart: flat_field", "image: a.exr")
    told = f"scene.depth = {name}: "
    hint = f"; a file is given as {{image: {name}, unit: m}}"
    text = load_and_get_message(folder, picture.replace("image: a.exr", f"image: a.exr\n  depth: {name}"))
    assert told in text and text.endswith(hint)
    assert load_and_get_message(folder, picture, [f"scene.depth={name}"]).endswith(hint)
    layers = SHOT.replace("chart: flat_field", f"layers: [{{image: a.exr, depth: {name}}}]")
    assert load_and_get_message(folder, layers).endswith(hint)


def test_what_is_neither_file_nor_distance_has_no_hint_of_files(folder):
    picture = SHOT.replace("chart: flat_field", "image: a.exr")
    assert "image:" not in load_and_get_message(folder, picture, ["scene.depth=far"])
    assert "image:" not in load_and_get_message(folder, picture, ["lens.focus_distance=z.npy"])


def test_yaml_1_1_traps_are_plain_text_or_numbers(folder):
    shot = load_shot(
        write_shot(folder, SHOT.replace("scene:", "name: on\nscene:").replace("f/4", "f/4\n  transmittance: 9e-1"))
    )
    assert shot.name == "on" and shot.lens.transmittance == 0.9
    assert load_shot(write_shot(folder, SHOT.replace("scene:", "name: 2024-01-01\nscene:"))).name == "2024-01-01"


@pytest.mark.parametrize("text", ["", "- a", "7", "a: &x [*x]", "[" * 5000, "a: b\n---\nc: d", "\x00", "\tlens: 3"])
def test_a_file_that_is_no_shot_is_one_message(folder, text):
    assert str(folder / "shot.yaml") in load_and_get_message(folder, text)


def test_aliases_that_multiply_are_refused_quickly(folder):
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    assert "without end" in load_and_get_message(folder, "\n".join(lines))


def test_missing_and_unreadable_files_are_one_message(tmp_path):
    with pytest.raises(PhotositeError, match="no such file"):
        load_shot(tmp_path / "none.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x80")
    with pytest.raises(PhotositeError, match="not UTF-8"):
        load_shot(tmp_path / "binary.yaml")
    with pytest.raises(PhotositeError, match="is a folder, not a file"):
        load_shot(tmp_path)


def test_a_changed_file_is_read_again(folder):
    assert load_shot(write_shot(folder)).lens.f_number == 4.0
    assert load_shot(write_shot(folder, SHOT.replace("f/4", "f/5.6"))).lens.f_number == 5.6


def test_the_resolved_configuration_gives_the_same_shot_again(folder):
    first = load_shot(write_shot(folder), ["exposure.time=1/3 s", "camera.stages.dark_current.rate=0.1 e-/s"])
    for suffix, text in ((".yaml", dump_yaml(first.resolved)), (".json", json.dumps(first.resolved))):
        path = folder / f"again{suffix}"
        path.write_text(text)
        again = load_shot(path)
        assert again.resolved == first.resolved
        assert (again.lens, again.exposure, again.scene, again.seeds, again.name) == (
            first.lens, first.exposure, first.scene, first.seeds, first.name,
        )  # fmt: skip
        np.testing.assert_array_equal(again.camera.response.quantum_efficiency, first.camera.response.quantum_efficiency)
        assert again.camera.iso_table == first.camera.iso_table and again.camera.stages == first.camera.stages
    assert first.resolved["lens"]["irradiance"] == "thin_lens"  # defaults are written out
    assert first.resolved["exposure"]["time"] == f"{1 / 3!r} s"
    sidecar = folder / "sidecar.json"
    sidecar.write_text(json.dumps({"shot": first.resolved, "versions": {}}))
    assert load_shot(sidecar).resolved == first.resolved


@pytest.mark.parametrize(
    ("section", "expected"),
    [
        ("shutter: {readout_time: 20 ms}", RollingShutter(0.02)),
        ("shutter: {scan_order: none}", RollingShutter(None, "none")),
        ("shutter: {travel_time: 3 ms, acceleration: 90 m/s^2}", CurtainShutter(0.003, 90.0)),
        ("shutter: {reset_time: 3 ms, travel_time: 4 ms}", FirstCurtainShutter(0.003, 0.004)),
        ("shutter: {opening: 1 ms, closing: 2 ms, widest_f_number: f/2}", LeafShutter(0.001, 0.002, 2.0)),
        ("shutter: {parasitic_light: 0.001, readout_time: 8 ms}", GlobalShutter(0.001, 0.008)),
        ("flicker: {frequency: 100 Hz, modulation: 0.3}", MainsFlicker(100.0, 0.3)),
        ("flicker: {frequency: 1 kHz, duty: 0.3, phase: 90 deg}", PwmLamp(1000.0, 0.3, 90.0)),
        ("flash: {energy: 20 J, beam: 60 deg, decay: 1 ms}", Flash(0.0, 0.001, energy_j=20.0, beam_deg=60.0)),
    ],
)
def test_kinds_of_shutter_flicker_and_flash_are_told_apart_by_their_keys(folder, section, expected):
    shot = load_shot(write_shot(folder, SHOT.replace("iso: 100", f"iso: 100\n  {section}")))
    key = section.partition(":")[0]
    assert getattr(shot.exposure, key) == expected
    assert load_shot(write_shot(folder, dump_yaml(shot.resolved))).exposure == shot.exposure
    changed = replace(shot, exposure=replace(shot.exposure, **{key: None}))
    assert key not in changed.resolved["exposure"]
    assert replace(changed, exposure=shot.exposure).resolved == shot.resolved


SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8)


def sections(inner):
    return st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3)


@given(st.recursive(SCALARS, sections))
def test_dumped_data_reads_back_unchanged(data):
    from simulator.config.document import parse_document

    data = {"data": data}
    assert parse_document(dump_yaml(data), "memory", Path()).data == data


LEAVES = """scene scene.chart scene.depth lens lens.cos4 lens.f_number exposure.iso camera camera.stages camera.iso_table.100
    camera.response camera.window camera.source seeds name sweep""".split()
VALUES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6) | st.lists(st.integers(), max_size=2)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.sampled_from(LEAVES), VALUES | st.dictionaries(st.text(max_size=4), VALUES, max_size=2))
def test_any_value_anywhere_is_a_shot_or_a_photosite_error(folder, key, value):
    try:
        load_shot(write_shot(folder), {key: value})
    except PhotositeError as error:
        assert str(error)


def test_parts_of_the_truth_are_a_list_of_known_names(folder):
    assert load_shot(write_shot(folder), ["truth=[rgb, depth]"]).truth == ("rgb", "depth")
    with pytest.raises(PhotositeError, match=r"truth\.0 = varianc: did you mean `variance`\? \(known: blur, depth, flow, rgb"):
        load_shot(write_shot(folder), ["truth=[varianc]"])


def test_infinity_is_a_distance(folder):
    shot = load_shot(write_shot(folder, SHOT.replace("2 m", "inf m")))
    assert math.isinf(shot.lens.focus_distance_m)
    assert shot.resolved["lens"]["focus_distance"] == "infinity"
    yaml.safe_load(textwrap.dedent(dump_yaml(shot.resolved)))  # any YAML reader takes it


def test_a_time_budget_is_stated_with_its_unit():
    shot = load_shot("flat_field", {"time_budget": "2000 ms"})
    assert shot.time_budget_s == 2.0 and shot.resolved["time_budget"] == "2 s"
    with pytest.raises(PhotositeError, match=r"time_budget = 2: has no unit; write a time such as 2\.?0? s"):
        load_shot("flat_field", {"time_budget": 2})
