"""The JSON Schema says what the reader says: it takes what loads and refuses what does not."""

import copy

import pytest
import yaml

from simulator.color.color_tables import CONFIGS
from simulator.config import schema

jsonschema = pytest.importorskip("jsonschema", reason="the test extra jsonschema is not installed")
SHOTS = sorted((CONFIGS / "shots").glob("*.yaml"))


@pytest.fixture(scope="module")
def validator():
    description = schema()
    jsonschema.Draft202012Validator.check_schema(description)
    return jsonschema.Draft202012Validator(description)


@pytest.mark.parametrize("path", SHOTS, ids=lambda path: path.stem)
def test_shipped_shots_satisfy_the_schema(validator, path):
    validator.validate(yaml.safe_load(path.read_text()))


def test_a_resolved_shot_satisfies_the_schema(validator):
    from simulator.config import load_shot

    resolved = copy.deepcopy(load_shot(SHOTS[0]).resolved)
    resolved["camera"]["iso_table"] = {str(iso): line for iso, line in resolved["camera"]["iso_table"].items()}
    validator.validate(resolved)


@pytest.mark.parametrize(
    "exposure",
    [
        {"shutter": {"readout_time": "20 ms", "scan_order": "left_to_right"}},
        {"shutter": {}},
        {"shutter": {"travel_time": "3 ms", "acceleration": "90 m/s^2", "distance": "2 mm"}},
        {"shutter": {"reset_time": "3 ms", "travel_time": "3 ms"}},
        {"shutter": {"opening": "1 ms", "closing": "1 ms", "widest_f_number": "f/2.8"}},
        {"shutter": {"parasitic_light": 0.0001}, "flicker": {"frequency": "240 Hz", "duty": 0.5}},
        {"flicker": {"frequency": "100 Hz", "modulation": 0.5, "harmonics": [{"order": 2, "modulation": 0.1}]}},
        {"flash": {"guide_number": "36 m", "length": "1/1000 s", "sync": "second_curtain"}},
    ],
)
def test_the_schema_takes_every_kind_of_shutter_flicker_and_flash(validator, exposure):
    shot = yaml.safe_load((CONFIGS / "shots" / "color_checker.yaml").read_text())
    shot["exposure"] |= exposure
    validator.validate(shot)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (("lens", "focal_length"), 50),
        (("lens", "focal_lenght"), "50 mm"),
        (("lens", "cos4"), "no"),
        (("exposure", "iso"), "100"),
        (("exposure", "time"), 0.01),
        (("scene", "chart"), "colour_checker"),
        (("scene", "chat"), "color_checker"),
        (("exposure", "shutter"), "rolling"),
        (("exposure", "shutter"), {"readout_time": 20}),
        (("exposure", "shutter"), {"readout_time": "20 ms", "travel_time": "3 ms"}),
        (("exposure", "flicker"), {"frequency": "100 Hz"}),
        (("exposure", "flash"), {"length": "1 ms", "sync": "rear"}),
        (("camera",), 3),
        (("camera",), {"bit_depth": 12}),
        (("camera",), {"base": "sony_a7s2", "iso_table": {"merge": 1}}),
        (("sweep",), {"vary": {"exposure.iso": {"from": 100, "to": 200}}}),
        (("sweep",), {"mode": "cross", "vary": {"exposure.iso": [100]}}),
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(validator, key, value):
    shot = yaml.safe_load((CONFIGS / "shots" / "color_checker.yaml").read_text())
    section = shot
    for part in key[:-1]:
        section = section[part]
    section[key[-1]] = value
    assert not validator.is_valid(shot)


def test_a_table_beside_a_base_may_say_merge(validator):
    shot = yaml.safe_load((CONFIGS / "shots" / "color_checker.yaml").read_text())
    for table in ({"merge": True, "100": {"gain": "1 DN/e-"}}, {"100": {"gain": "1 DN/e-", "read_noise": "1 DN"}}, None):
        shot["camera"] = {"base": "sony_a7s2", "iso_table": table}
        validator.validate(shot)


def test_units_and_meanings_stand_in_the_schema():
    lens = schema()["$defs"]["ThinLens"]["properties"]
    assert "50 mm" in str(lens["focal_length"]) and "f [mm]" in str(lens["focal_length"])
    assert "f/2.8" in str(lens["f_number"])
