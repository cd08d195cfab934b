"""The controls of a shot: one for each thing that a photographer turns, at the value that the shot has."""

import math

import pytest

from simulator.config import load_shot
from simulator.explore.controls import controls_of


def by_key(shot):
    return {control.key: control for control in controls_of(shot)}


def test_every_control_stands_at_the_value_of_the_shot_and_its_texts_build_the_shot_they_say():
    shot = load_shot("color_checker")
    for key, control in by_key(shot).items():
        numbers = [choice.number for choice in control.choices]
        assert numbers == sorted(numbers) and len(set(numbers)) == len(numbers)
        chosen = load_shot(
            "color_checker", {key: int(control.choices[-1].text) if key == "exposure.iso" else control.choices[-1].text}
        )
        again = by_key(chosen)[key]
        assert again.choices[again.index].number == pytest.approx(numbers[-1], rel=1e-5)
        same = by_key(shot)[key].choices[control.index]
        own = {"exposure.iso": shot.exposure.iso, "exposure.time": shot.exposure.time_s, "lens.f_number": shot.lens.f_number}
        assert key not in own or same.number == own[key]


def test_an_odd_value_of_the_shot_gets_a_place_of_its_own():
    control = by_key(load_shot("color_checker", ["lens.f_number=f/5.13"]))["lens.f_number"]
    labels = [choice.label for choice in control.choices]
    place = labels.index("f/5.13")
    assert control.index == place and labels[place - 1 : place + 2] == ["f/5", "f/5.13", "f/5.6"]


def test_what_a_shot_does_not_have_gets_no_control():
    pinhole = by_key(load_shot("color_checker", ["lens={pinhole: {diameter: 0.3 mm, distance: 50 mm}}"]))
    assert not any(key.startswith("lens.") for key in pinhole)
    metered = by_key(load_shot("color_checker", ["exposure={mode: aperture_priority, iso: 100}"]))
    assert "exposure.time" not in metered and "exposure.iso" in metered
    clip = ["motion.camera.clip=the_zeek_2d"]
    assert "motion.camera.pan" in by_key(load_shot("color_checker"))
    assert "motion.camera.pan" not in by_key(load_shot("color_checker", clip))


def test_focus_begins_beyond_the_focal_length_and_ends_at_infinity():
    distances = [
        choice.number
        for choice in by_key(load_shot("color_checker", ["lens.focal_length=400 mm"]))["lens.focus_distance"].choices
    ]
    assert distances[0] > 0.4 and distances[-1] == math.inf
