"""Warnings say what clips, what light would blur, and what a frame cannot show."""

import re

import numpy as np
import pytest
from helpers.tiny_shot import tiny_folder, write_shot

from simulator.config import frame_warnings, load_shot, shot_warnings
from simulator.pipeline.simulate import simulate


@pytest.fixture
def folder(tmp_path):
    return tiny_folder(tmp_path)


def test_warnings_say_where_highlights_and_dark_clip(folder):
    clipped = load_shot(write_shot(folder), ["camera.stages.full_well.capacity=9000 e-"])
    assert len(shot_warnings(clipped)) == 1
    assert "8062 e-" in shot_warnings(clipped)[0]  # (4095 - 64) DN / 0.5 DN/e-
    dark = load_shot(write_shot(folder), ["camera.black_level=7.9 DN"])
    assert any("4 sigma" in text for text in shot_warnings(dark))
    settings = ["camera.black_level=8 DN", "camera.stages.full_well.capacity=8000 e-"]
    assert shot_warnings(load_shot(write_shot(folder), settings)) == []


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("lens.f_number=f/22", r"lens.f_number = f/22: its Airy disk is \d+ photosites .* write lens.diffraction: true"),
        (
            "lens={pinhole: {diameter: 0.3 mm, distance: 50 mm, diffraction: false}}",
            r"lens.pinhole.diameter = 0.3 mm: its Airy disk .* write lens.pinhole.diffraction: true",
        ),
    ],
)
def test_a_lens_too_small_for_light_without_diffraction_is_warned_of(folder, setting, says):
    found = shot_warnings(load_shot(write_shot(folder), ["camera.pixel_pitch=4 um", setting]))
    assert len(found) == 1 and re.search(says, found[0])


@pytest.mark.parametrize(
    "setting",
    [
        "lens.f_number=f/2.8",
        "lens={bare_sensor: {}}",
        "lens={pinhole: {diameter: 0.3 mm, distance: 50 mm}}",
        ["lens.f_number=f/22", "lens.diffraction=true"],
    ],
)
def test_a_lens_as_sharp_as_light_allows_is_not_warned_of(folder, setting):
    settings = ["camera.pixel_pitch=4 um", *([setting] if isinstance(setting, str) else setting)]
    assert shot_warnings(load_shot(write_shot(folder), settings)) == []


@pytest.mark.parametrize(
    ("time", "says"),
    [
        ("10 s", r"exposure.time = 10 s: 100 % of the photosites clip, the frame shows nothing; with [\d.e-]+ s"),
        (
            "1e-9 s",
            r"exposure.time = 1e-09 s: no photosite's signal .* reaches the noise in the dark .* the frame is black; with",
        ),
    ],
)
def test_a_frame_that_shows_nothing_is_warned_of_with_a_time_that_shows_something(time, says):
    settings = ["camera.window={x: 0, y: 0, width: 64, height: 48}", "exposure.iso=100"]
    found = frame_warnings(simulate(load_shot("flat_field", [*settings, f"exposure.time={time}"])))
    assert len(found) == 1 and re.search(says, found[0])
    better = re.search(r"with ([\d.e+-]+) s", found[0])[1]
    raw = simulate(load_shot("flat_field", [*settings, f"exposure.time={better} s"]))
    assert frame_warnings(raw) == []
    assert 0.9 < (np.percentile(raw.noise_free_dn, 99) - raw.black_level_dn) / (raw.white_level_dn - raw.black_level_dn) <= 1.0


def test_dark_current_alone_shows_nothing():
    settings = [
        "camera.window={x: 0, y: 0, width: 64, height: 48}",
        "exposure.iso=800",
        "exposure.time=30 s",
        "scene.reflectance=0",
    ]
    found = frame_warnings(simulate(load_shot("flat_field", [*settings, "camera.stages.dark_current={rate: 20 e-/s}"])))
    assert len(found) == 1 and "the frame is black" in found[0]
