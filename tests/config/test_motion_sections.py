"""Motion in a shot file: kinds are told apart by their keys, speeds have units, and a resolved shot reads back."""

from dataclasses import replace

import pytest
import yaml
from helpers.bad_input import SHOT

from simulator.config import load_shot, schema
from simulator.config.speed_text import format_speed, parse_speed
from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.camera_table import CameraTable, MeasuredClip
from simulator.exposure.hand_tremor import HandTremor
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.vector_maps import BlenderVectors, VectorMap


def load(tmp_path, text, overrides=()):
    path = tmp_path / "shot.yaml"
    path.write_text(SHOT + f"motion:\n  {text}\n")
    return load_shot(path, overrides)


CAMERAS = {
    "{pan: 10 deg/s, back: 3.6 km/h}": SteadyMotion(pan_deg_per_s=10.0, back_m_per_s=1.0),
    "{clip: investigation, seed: 3, rms: 2 deg/s}": MeasuredClip("investigation", 3, 2.0),
    "{rms: 1 deg/s, lowest: 4 Hz, seed: 2}": HandTremor(1.0, lowest_hz=4.0, seed=2),
    "{path: /a/camera.csv, unit: mm, start: 10 ms}": CameraTable(path="/a/camera.csv", unit="mm", start_s=0.01),
}


@pytest.mark.parametrize("text", CAMERAS)
def test_kinds_of_camera_paths_are_told_apart_by_their_keys(tmp_path, text):
    camera = load(tmp_path, f"camera: {text}").motion.camera
    expected = CAMERAS[text]
    assert type(camera) is type(expected)
    assert {name: str(value) for name, value in vars(camera).items()} == {
        name: str(value) for name, value in vars(expected).items()
    }


def test_layers_and_vectors_are_read(tmp_path):
    shot = load(tmp_path, "layers: {0: {velocity: [120 px/s, 0 px/s]}, 1: {spin: 720 deg/s, centre: [3, 4.5], path: a.csv}}")
    assert shot.motion.layers[0] == LayerMotion((Speed(120.0, "px/s"), Speed(0.0, "px/s")))
    assert shot.motion.layers[1] == LayerMotion(None, 720.0, (3.0, 4.5), tmp_path / "a.csv")
    shot = load(tmp_path, "vectors: {image: a.exr, unit: px/frame}\n  frame_time: 1/24 s")
    assert shot.motion.vectors == VectorMap(tmp_path / "a.exr", "px/frame") and shot.motion.frame_time_s == 1 / 24
    shot = load(tmp_path, "vectors: {image: a.exr, vector_pass: ViewLayer.Vector}\n  frame_time: 1/24 s")
    assert shot.motion.vectors == BlenderVectors(tmp_path / "a.exr", "ViewLayer.Vector")


@pytest.mark.parametrize(
    "text",
    [
        "camera: {clip: investigation}",
        "camera: {rms: 1 deg/s}",
        "layers: {0: {velocity: [1 m/frame, -2 m/frame]}}\n  frame_time: 40 ms",
        "vectors: {image: a.exr, unit: m/s}",
    ],
)
def test_a_resolved_shot_reads_back_and_satisfies_the_schema(tmp_path, text):
    shot = load(tmp_path, text)
    (tmp_path / "again.yaml").write_text(yaml.safe_dump(shot.resolved))
    again = load_shot(tmp_path / "again.yaml")
    assert again.motion == shot.motion and again.resolved == shot.resolved
    jsonschema = pytest.importorskip("jsonschema", reason="the test extra jsonschema is not installed")
    layers = {str(number): layer for number, layer in shot.resolved["motion"]["layers"].items()}
    description = schema()
    motion = {"$schema": description["$schema"], "$defs": description["$defs"], **description["properties"]["motion"]}
    jsonschema.Draft202012Validator(motion).validate(shot.resolved["motion"] | {"layers": layers})


def test_a_shot_with_another_motion_says_so(tmp_path):
    shot = load(tmp_path, "layers: {0: {spin: 1 deg/s}}")
    moving = replace(shot.motion, layers={0: LayerMotion((Speed(2.5, "m/s"), Speed(0.0, "m/s")))})
    assert replace(shot, motion=moving).resolved["motion"]["layers"][0]["velocity"] == ["2.5 m/s", "0 m/s"]


def test_a_value_of_a_layer_is_set_by_its_path(tmp_path):
    shot = load(tmp_path, "layers: {1: {spin: 1 deg/s}}", ["motion.layers.1.spin=5 deg/s", "motion.camera.pan=1 deg/s"])
    assert shot.motion.layers[1].spin_deg_per_s == 5.0 and shot.motion.camera.pan_deg_per_s == 1.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "layers: {0: {velocity: [120, 0]}}",
            "motion.layers.0.velocity.0 = 120: has no unit; write a speed with its unit",
        ),
        ("layers: {0: {velocity: ['120', 0 px/s]}}", "motion.layers.0.velocity.0 = 120: has no unit"),
        ("layers: {0: {velocity: [120 px, 0 px/s]}}", "motion.layers.0.velocity.0 = 120 px: `px` is no unit of a speed"),
        ("layers: {0: {velocity: [1 px/s, 1 m/s]}}", r"motion.layers.0.velocity = \[1 px/s, 1 m/s\]: give both"),
        (
            "layers: {0: {velocity: [1 px/frame, 1 px/frame]}}",
            "motion.layers.0.velocity = per frame: needs .* motion.frame_time",
        ),
        ("vectors: {image: a.exr}", "motion.vectors.unit is missing"),
        ("vectors: {image: a.exr, unit: px}", "motion.vectors.unit = px: .*px/frame"),
        ("camera: {pan: 10}", "motion.camera.pan = 10: has no unit; write a speed of rotation"),
        ("camera: {pan: 10 m/s}", "motion.camera.pan = 10 m/s: is a speed; a speed of rotation such as 10 deg/s is wanted"),
        (
            "camera: {clip: investigation, lowest: 2 Hz}",
            r"motion.camera.lowest: is of another kind \(hand tremor\) than the keys beside it \(measured clip\); keep one "
            "kind: steady motion: back, .*; hand tremor: highest, location_rms, lowest",
        ),
        (
            "camera: {pan: 2 deg/s, rms: 3 deg/s}",
            r"motion.camera.rms: is of another kind \(measured clip or hand tremor\) .*\(steady motion\)",
        ),
        ("camera: {pan: 2 deg/s, tlt: 3 deg/s}", "motion.camera.tlt: unknown key; did you mean `tilt`"),
        ("camera: {clip: hand}", "motion.camera.clip = hand: .*the_closeup"),
        ("camera: {clip: the_closeup, rms: -1 deg/s}", "motion.camera.rms = -1.0 deg/s: give 0 or more"),
    ],
)
def test_what_cannot_be_a_motion_is_one_message_with_its_line(tmp_path, text, message):
    with pytest.raises(PhotositeError, match=rf"shot.yaml:9: {message}"):
        load(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "speed"),
    [
        ("120 px/s", Speed(120.0, "px/s")),
        ("-1.5 m/s", Speed(-1.5, "m/s")),
        ("36 km/h", Speed(10.0, "m/s")),
        ("1/2 px/frame", Speed(0.5, "px/frame")),
        ("3 cm/frame", Speed(0.03, "m/frame")),
        ("6 px/ms", Speed(6000.0, "px/s")),
    ],
)
def test_a_speed_keeps_what_it_is_measured_in(text, speed):
    found = parse_speed(text)
    assert found.unit == speed.unit and found.value == pytest.approx(speed.value, rel=1e-15)
    assert parse_speed(format_speed(found)) == found


@pytest.mark.parametrize("value", [True, None, [1], "fast", "px/s", "1 px/s/s"])
def test_what_is_no_speed_is_refused(value):
    with pytest.raises(ValueError, match="speed|quantity"):
        parse_speed(value)
