"""Charts that the page offers hang where the opened shot's lens is focused, as wide as it sees, in its light."""

import pytest

from simulator.config import load_shot
from simulator.explore.scene_list import CHARTS, OWN, chart_section, scene_labels


def test_a_chart_fills_the_picture_of_the_opened_lens_at_its_distance_in_its_light():
    shot = load_shot("color_checker", ["scene.luminance=300 cd/m^2", "scene.illuminant=A", "lens.focus_distance=3 m"])
    section = chart_section("dots", shot)
    again = load_shot("color_checker", {"scene": section}).scene
    assert (again.chart, again.luminance_cd_m2, again.illuminant, again.depth_m) == ("dots", 300.0, "A", 3.0)
    assert again.field_of_view_deg == pytest.approx(shot.lens.field_of_view_deg(shot.camera.sensor_mm[0]), rel=1e-5)
    assert again.outside == "black"


def test_every_chart_can_be_taken_by_every_kind_of_lens():
    lenses = ("{focal_length: 50 mm, f_number: f/4}", "{pinhole: {diameter: 0.3 mm, distance: 50 mm}}", "{bare_sensor: {}}")
    for lens in lenses:  # the first is focused at infinity
        shot = load_shot("color_checker", [f"lens={lens}"])
        for chart in CHARTS:
            assert load_shot("color_checker", {"scene": chart_section(chart, shot)}).scene.chart == chart


def test_the_opened_scene_comes_first():
    assert list(scene_labels(load_shot("flat_field")))[0] == OWN
    assert scene_labels(load_shot("flat_field"))[OWN] == "As opened: Flat field"
