"""The configuration that a frame carries is that of the shot taken, also where parts of a loaded shot were replaced."""

import json
import pickle
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from helpers.scene_builders import FixedScene

from simulator.config import build_shot_from_data, load_camera, load_shot
from simulator.config.document_merge import CONFIGS
from simulator.config.shot_text import is_same
from simulator.exposure.settings import Exposure
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.raw_format import RawFormat
from simulator.raw.save import save
from simulator.scene.charts import ChartScene
from simulator.scene.depth import DepthImage
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.readout_window import Window
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.studies.resimulation import resimulate

SHOT = """\
scene: {chart: flat_field, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, source: mine, window: {x: 0, y: 0, width: 64, height: 48}}
"""
ZERNIKE = Aberrations(zernike_um={4: 0.1, 11: -0.3}, chromatic=(ChromaticShift(450.0, 10.0), ChromaticShift(650.0, -10.0)))
LENS = ThinLens(35.0, 8.0, 3.0, aberrations=ZERNIKE)
CHANGES = {
    "nothing": lambda shot: {},
    "exposure": lambda shot: {"exposure": Exposure(1 / 3, 3200, "2026-05-01 12:30:00")},
    "whole numbers": lambda shot: {"exposure": Exposure(1, 100), "tolerance": 0},
    "numbers of NumPy": lambda shot: {"exposure": Exposure(np.float64(0.1), 100), "tolerance": np.float64(0.5)},
    "f-number": lambda shot: {"lens": replace(shot.lens, f_number=5.6)},
    "lens": lambda shot: {"lens": LENS},
    "pinhole": lambda shot: {"lens": Pinhole(0.3, 50.0)},
    "bare sensor": lambda shot: {"lens": BareSensor()},
    "window": lambda shot: {"camera": replace(shot.camera, window=Window(8, 6, 48, 64))},
    "stages": lambda shot: {"camera": replace(shot.camera, stages=shot.camera.stages | {"dark_current": DarkCurrent(50.0)})},
    "fewer stages": lambda shot: {"camera": replace(shot.camera, stages={})},
    "ISO table": lambda shot: {
        "camera": replace(shot.camera, iso_table={100: shot.camera.iso_table[200]}, conversion_gain=None)
    },
    "binning": lambda shot: {"camera": replace(shot.camera, binning=Binning(2, "average"))},
    "scene": lambda shot: {"scene": ChartScene("grey_ramp", 50.0)},
    "seeds and files": lambda shot: {"seeds": Seeds(3, 4), "raw": RawFormat("packed"), "name": "other", "truth": ("depth",)},
}


@pytest.fixture
def shot(tmp_path):
    (tmp_path / "a.yaml").write_text(SHOT)
    return load_shot(tmp_path / "a.yaml")


@pytest.mark.parametrize("change", CHANGES)
def test_the_files_of_a_changed_shot_give_its_frame_again(tmp_path, shot, change):
    changed = replace(shot, **CHANGES[change](shot))
    raw = simulate(changed)
    files = save(raw, tmp_path)
    again = load_shot(files.sidecar)
    assert is_same(again, changed) and again.resolved == changed.resolved
    for other in (simulate(again), resimulate(files.dng)):
        np.testing.assert_array_equal(other.dn, raw.dn)
        np.testing.assert_array_equal(other.mean_electrons, raw.mean_electrons)


@pytest.mark.parametrize("name", sorted(path.stem for path in (CONFIGS / "cameras").glob("*.yaml")))
def test_a_shot_with_another_camera_says_so_bit_for_bit(shot, name):
    camera = load_camera(name)
    iso = next(iter(camera.iso_table), 400)
    changed = replace(shot, camera=camera, exposure=replace(shot.exposure, iso=iso))
    data = json.loads(json.dumps(changed.resolved))
    assert data["camera"]["model"] == camera.model
    assert is_same(build_shot_from_data(data, "a.json", {}).camera, camera)


def test_pictures_keep_their_places(tmp_path, shot, monkeypatch):
    np.save(tmp_path / "a.npy", np.ones((8, 12, 3), np.float32))
    np.save(tmp_path / "z.npy", np.ones((8, 12), np.float32))
    monkeypatch.chdir(tmp_path)
    picture = ImageScene(Path("a.npy"), luminance_cd_m2=10.0, depth_m=DepthImage(Path("z.npy"), unit="mm"))
    layers = LayeredScene((PictureLayer(Path("a.npy"), 1.0), PictureLayer(Path("a.npy"), 2.0)), luminance_cd_m2=10.0)
    assert replace(shot, scene=picture).resolved["scene"]["depth"]["image"] == f"{tmp_path / 'z.npy'}"
    assert [one["image"] for one in replace(shot, scene=layers).resolved["scene"]["layers"]] == [f"{tmp_path / 'a.npy'}"] * 2


def test_what_was_not_replaced_keeps_its_words(shot):
    """Sources of numbers stand in no object: those of a section go when a number of it is replaced."""
    assert replace(shot, exposure=Exposure(0.5)).resolved["camera"]["source"] == "mine"
    changed = replace(shot, camera=replace(shot.camera, bit_depth=12))
    assert "source" not in changed.resolved["camera"] and changed.resolved["camera"]["bit_depth"] == 12
    assert "source" in shot.resolved["camera"]["response"]
    assert changed.resolved["camera"]["response"] == shot.resolved["camera"]["response"]
    assert changed.resolved["scene"] == shot.resolved["scene"]


def test_a_shot_changed_twice_or_back_or_sent_to_another_process_says_what_it_is(shot):
    changed = replace(replace(shot, exposure=Exposure(0.5)), name="b")
    assert (changed.resolved["exposure"]["time"], changed.resolved["name"]) == ("0.5 s", "b")
    assert replace(changed, exposure=shot.exposure, name=shot.name).resolved == shot.resolved
    for one in (shot, changed):
        assert pickle.loads(pickle.dumps(one)).resolved == one.resolved


def test_a_part_that_no_file_can_hold_leaves_nothing(shot):
    scene = ChartScene("flat_field", 100.0)
    assert replace(shot, scene=FixedScene(scene.load())).resolved == {}
    assert replace(shot, scene=scene.load()).resolved == {}
    assert Shot(scene, shot.lens, shot.exposure, shot.camera).resolved == {}


def test_every_part_of_a_shot_is_compared(shot):
    names = {field.name for field in fields(Shot) if field.compare}
    assert names == {field.name for field in fields(Shot)} - {"origin", "interval_s"}
    assert all(is_same(shot, replace(shot, **{name: getattr(shot, name)})) for name in names)
    assert not is_same(shot, replace(shot, seeds=Seeds(9)))


@pytest.mark.parametrize("name", ["dual_gain", "split_pixels"])
def test_a_list_that_its_object_completes_is_told_when_another_part_is_replaced(name):
    shot = load_shot("color_checker", {"camera": f"illustrative/{name}"})
    changed = replace(shot, seeds=Seeds(0, 7))
    again = build_shot_from_data(changed.resolved, "again", {})
    assert again.seeds == Seeds(0, 7) and is_same(again.camera, shot.camera)
