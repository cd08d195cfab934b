"""`photosite lens`: a lecture's numbers, closed forms over random lenses; table, JSON, CSV and picture have the same values."""

import csv
import io
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulator.command_line.lens_figure import cone_mm, draw_lens, gauss_rays_mm
from simulator.command_line.lens_numbers import list_numbers
from simulator.command_line.main import main
from simulator.optics.lens.thin_lens import ThinLens

FULL_FRAME = (36.0, 24.0)
FIFTY = ("lens", "--focal-length", "50mm", "--f-number", "f/1.8", "--focus-distance", "2m")

focal_lengths_mm = st.floats(2.0, 800.0)
f_numbers = st.floats(0.5, 64.0)
circles_um = st.floats(1.0, 200.0)
ratios = st.floats(1.01, 1e5)  # focus distance over focal length


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def values_of(lens, sensor_mm=FULL_FRAME, distances_m=()) -> dict[str, float]:
    return {number.key: number.value for number in list_numbers(lens, sensor_mm, distances_m)}


def told(capsys, *arguments: str) -> dict[str, float]:
    """Numbers that the command gives as JSON, by key."""
    code, out, err = run(capsys, *arguments, "--format", "json")
    assert code == 0, err
    return {number["key"]: float(number["value"]) for number in json.loads(out)["numbers"]}


@pytest.mark.parametrize(("focal_length_mm", "angle_deg"), [(17, 104), (50, 47), (200, 12)])
def test_the_lecture_s_angles_of_view(capsys, focal_length_mm, angle_deg):
    found = told(capsys, "lens", "--focal-length", f"{focal_length_mm}mm", "--f-number", "f/4")
    assert round(found["field_of_view_diagonal_deg"]) == angle_deg


@settings(max_examples=60, deadline=None)
@given(focal_lengths_mm, f_numbers, ratios)
def test_the_f_number_is_focal_length_over_pupil(f_mm, f_number, ratio):
    found = values_of(ThinLens(f_mm, f_number, 1e-3 * f_mm * ratio))
    assert found["focal_length_mm"] / found["pupil_diameter_mm"] == pytest.approx(f_number, rel=1e-12)
    assert found["working_f_number"] == pytest.approx(f_number * (1 + 1 / (ratio - 1)), rel=1e-9)  # m = f / (z_o - f)


@settings(max_examples=60, deadline=None)
@given(focal_lengths_mm, f_numbers, ratios, st.floats(0.05, 1e4), st.floats(1.0, 8.0))
def test_blur_circles_are_in_inverse_proportion_to_the_f_number(f_mm, f_number, ratio, subject_m, stop):
    focus_m = 1e-3 * f_mm * ratio
    wide, stopped = (
        values_of(ThinLens(f_mm, number, focus_m), distances_m=[subject_m])["blur_circle_um"]
        for number in (f_number, f_number * stop)
    )
    assert stopped * stop == pytest.approx(wide, rel=1e-9, abs=1e-12)
    # Textbook form: C = f^2 |z - s| / (N z (s - f)), all in mm; the difference is formed last there, too.
    z_mm, s_mm = 1e3 * subject_m, 1e3 * focus_m
    expected_um = 1e3 * f_mm**2 * abs(z_mm - s_mm) / (f_number * z_mm * (s_mm - f_mm))
    assert wide == pytest.approx(expected_um, rel=1e-6, abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(focal_lengths_mm, f_numbers, circles_um, ratios)
def test_limits_of_the_depth_of_field_are_the_textbook_s(f_mm, f_number, circle_um, ratio):
    """s (H - f) / (H + s - 2 f) and s (H - f) / (H - s), H = f^2 / (N c) + f (Wikipedia, "Depth of field")."""
    focus_m = 1e-3 * f_mm * ratio
    found = values_of(ThinLens(f_mm, f_number, focus_m, circle_of_confusion_um=circle_um))
    hyperfocal_mm, s_mm = f_mm**2 / (f_number * 1e-3 * circle_um) + f_mm, 1e3 * focus_m
    assert found["hyperfocal_distance_m"] == pytest.approx(1e-3 * hyperfocal_mm, rel=1e-12)
    near_mm = s_mm * (hyperfocal_mm - f_mm) / (hyperfocal_mm + s_mm - 2 * f_mm)
    assert found["near_limit_m"] == pytest.approx(1e-3 * near_mm, rel=1e-9)
    if s_mm < 0.999 * hyperfocal_mm:
        far_mm = s_mm * (hyperfocal_mm - f_mm) / (hyperfocal_mm - s_mm)
        assert found["far_limit_m"] == pytest.approx(1e-3 * far_mm, rel=1e-9)
        assert found["depth_of_field_m"] == pytest.approx(1e-3 * (far_mm - near_mm), rel=1e-5)
    elif s_mm > 1.001 * hyperfocal_mm:
        assert found["far_limit_m"] == found["depth_of_field_m"] == math.inf


@settings(max_examples=200, deadline=None)
@given(focal_lengths_mm, f_numbers, circles_um, st.floats(1.0, 1e6))
def test_at_the_hyperfocal_distance_and_beyond_all_is_sharp_up_to_infinity(f_mm, f_number, circle_um, factor):
    hyperfocal_m = ThinLens(f_mm, f_number).hyperfocal_m(circle_um)
    near_m, far_m = ThinLens(f_mm, f_number, hyperfocal_m).depth_of_field_m(circle_um)
    assert far_m == math.inf and near_m == pytest.approx(hyperfocal_m / 2, rel=1e-9)
    assert ThinLens(f_mm, f_number, hyperfocal_m * factor).depth_of_field_m(circle_um)[1] == math.inf
    assert ThinLens(f_mm, f_number).depth_of_field_m(circle_um)[1] == math.inf


@settings(max_examples=60, deadline=None)
@given(focal_lengths_mm, ratios, st.floats(1.0, 60.0), st.floats(1.0, 60.0))
def test_the_field_in_focus_fills_the_field_of_view(f_mm, ratio, width_mm, height_mm):
    focus_m = 1e-3 * f_mm * ratio
    found = values_of(ThinLens(f_mm, 4.0, focus_m), (width_mm, height_mm))
    half_rad = math.atan(0.5 * found["field_width_m"] / focus_m)
    assert math.degrees(2 * half_rad) == pytest.approx(found["field_of_view_horizontal_deg"], rel=1e-9)
    assert found["field_height_m"] * found["magnification"] == pytest.approx(1e-3 * height_mm, rel=1e-9)
    diagonal_mm = math.hypot(width_mm, height_mm)
    assert found["crop_factor"] == pytest.approx(math.hypot(36, 24) / diagonal_mm)
    far = ThinLens(f_mm, 4.0)  # the equivalent on 36 mm x 24 mm sees the same, focused at infinity
    same = ThinLens(found["focal_length_35mm_mm"], found["f_number_35mm"])
    assert same.field_of_view_deg(math.hypot(36, 24)) == pytest.approx(far.field_of_view_deg(diagonal_mm), rel=1e-9)
    assert same.pupil_diameter_mm == pytest.approx(far.pupil_diameter_mm)


def test_table_json_and_csv_tell_the_same(capsys):
    arguments = (*FIFTY, "--time", "1/125s", "--iso", "400", "--at", "4m", "--at", "inf")
    numbers = json.loads(run(capsys, *arguments, "--format", "json")[1])["numbers"]
    rows = list(csv.DictReader(io.StringIO(run(capsys, *arguments, "--format", "csv")[1])))
    assert [{key: "" if value is None else str(value) for key, value in one.items()} for one in numbers] == rows
    table = run(capsys, *arguments)[1]
    assert all(one["quantity"] in table and one["formula"] in table for one in numbers)
    found = {(one["key"], one["at_m"]): one["value"] for one in numbers}
    assert found["blur_circle_um", 4.0] == pytest.approx(356.13, rel=1e-4)  # R18 of tests/optics/lens/test_lens.py
    assert found["blur_circle_um", "infinity"] == pytest.approx(712.25, rel=1e-4)
    assert found["exposure_value", None] == pytest.approx(math.log2(1.8**2 * 125))
    assert found["exposure_value_100", None] == pytest.approx(math.log2(1.8**2 * 125 / 4))
    assert "712.3 um" in table and "f/1.8462" in table and "8.66 EV" in table


def test_infinity_is_told_in_words_that_floats_read(capsys):
    found = told(capsys, "lens", "--focal-length", "35mm", "--f-number", "8", "--focus-distance", "20m")
    assert found["far_limit_m"] == found["depth_of_field_m"] == math.inf
    assert found["near_limit_m"] < found["hyperfocal_distance_m"] < 20


@pytest.mark.parametrize(
    ("options", "crop"),
    [
        (("--sensor", "23.6mm x 15.6mm"), 1.529),
        (("--sensor", "four_thirds"), 1.999),
        (("--camera", "nikon_d3"), 1.000),
        (("--camera", "canon_550d"), 1.613),
    ],
)
def test_the_sensor_is_a_size_a_format_or_a_camera_s(capsys, options, crop):
    assert told(capsys, *FIFTY, *options)["crop_factor"] == pytest.approx(crop, abs=0.01)


def test_a_shot_file_gives_lens_camera_and_exposure_and_options_change_them(capsys):
    found = told(capsys, "lens", "color_checker")
    changed = told(capsys, "lens", "color_checker", "--f-number", "f/11", "--time", "1/30 s", "--set", "lens.transmittance=0.9")
    assert (found["focal_length_mm"], found["f_number"], changed["f_number"]) == (50.0, 4.0, 11.0)
    assert changed["exposure_value"] == pytest.approx(math.log2(121 * 30))
    assert changed["t_number"] == pytest.approx(11 / math.sqrt(0.9))
    assert "photosites" in run(capsys, "lens", "color_checker")[1]


def test_the_camera_s_own_choice_of_exposure_is_shown(capsys):
    settings = ("--set", "exposure.mode=aperture_priority", "--set", "exposure.time=null")
    found = told(capsys, "lens", "flat_field", *settings)
    assert math.isfinite(found["exposure_value"])


def test_a_pinhole_has_the_numbers_that_a_hole_has(capsys):
    found = told(capsys, "lens", "--set", "lens.pinhole={diameter: 0.3 mm, distance: 50 mm}", "--at", "1m")
    assert found["blur_circle_um"] == pytest.approx(315.0) and "hyperfocal_distance_m" not in found
    found = told(capsys, "lens", "--set", "lens.bare_sensor={}")
    assert found["irradiance_per_radiance_sr"] == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("lens",), "--focal-length and --f-number: is needed without a shot"),
        (("lens", "--focal-length", "50mm"), "--f-number: is needed without a shot"),
        (("lens", "--focal-length", "50", "--f-number", "2"), "--focal-length 50: lens.focal_length = 50: has no unit"),
        ((*FIFTY[:-1], "2cm"), "--focus-distance 2cm: lens.focus_distance = 0.02 m: nothing nearer"),
        ((*FIFTY, "--sensor", "huge"), "--sensor huge: give width x height, such as"),
        ((*FIFTY, "--sensor", "0mm x 1mm"), "--sensor 0mm x 1mm: give width x height"),
        ((*FIFTY, "--at", "0m"), "--at 0m: give a distance above 0 m"),
        ((*FIFTY, "--at", "near"), "--at near: is no quantity"),
        ((*FIFTY, "--time", "0s"), "--time 0s: the shutter must open"),
        ((*FIFTY, "--format", "xml"), "--format xml: give one of table, json, csv"),
        ((*FIFTY, "--camera", "sony_a7s3"), "did you mean `sony_a7s2`"),
        ((*FIFTY, "--plot", "lens.bmp"), "--plot lens.bmp: end the name with .svg, .png, .pdf"),
        (("lens", "color_cheker"), "did you mean `color_checker`"),
    ],
)
def test_bad_options_are_told_in_one_line(capsys, arguments, message):
    code, out, err = run(capsys, *arguments)
    assert code == 1 and out == "" and len(err.splitlines()) <= 2, err
    assert message in err


LENSES = [ThinLens(50.0, 1.8, 2.0), ThinLens(4.2, 2.0, 0.15), ThinLens(100.0, 2.8, 0.2), ThinLens(24.0, 11.0)]


@pytest.mark.parametrize("lens", LENSES)
def test_gauss_s_rays_meet_in_the_image(lens):
    f_mm, rays = lens.focal_length_mm, gauss_rays_mm(lens, 7.0)
    for ray in rays:
        assert ray[-1] == pytest.approx([lens.image_distance_mm, -7.0])
        (x_0, y_0), (_, y), (x_1, y_1) = ray
        before, behind = (y - y_0) / -x_0, (y_1 - y) / x_1
        assert behind == pytest.approx(before - y / f_mm, abs=1e-12)  # an ideal lens turns a ray at height y by y / f


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("distance_m", [0.3, 7.0, math.inf])
def test_the_cone_of_a_point_is_as_wide_at_the_sensor_as_its_blur_circle(lens, distance_m):
    image_mm, half_mm = cone_mm(lens, distance_m)
    assert half_mm == pytest.approx(0.5 * lens.pupil_diameter_mm * abs(1 - lens.image_distance_mm / image_mm), abs=1e-12)


@pytest.mark.parametrize("lens", LENSES)
def test_three_panels_are_to_scale_and_the_fourth_draws_the_blur(lens):
    figure = draw_lens(lens, FULL_FRAME, [0.5, 8.0, math.inf], "lens")
    *drawn, blur = figure.axes
    assert all(axes.get_aspect() == 1.0 for axes in drawn)
    (line,) = [line for line in blur.lines if line.get_label() == "blur circle"]
    along_m, blur_um = np.asarray(line.get_data())
    assert (np.diff(along_m) > 0).all() and along_m[0] > 1e-3 * lens.focal_length_mm
    exact_um = 2.0 * np.abs(lens.blur_radius_um(along_m))
    seen = exact_um > blur.get_ylim()[0]
    assert seen.sum() > 100 and np.array_equal(blur_um[seen], exact_um[seen])


def test_the_picture_is_written_whole_and_named(tmp_path, capsys):
    code, out, _ = run(capsys, *FIFTY, "--plot", str(tmp_path / "lens.svg"))
    assert code == 0 and out.splitlines()[-1] == str(tmp_path / "lens.svg")
    assert (tmp_path / "lens.svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")
    assert [path.name for path in tmp_path.iterdir()] == ["lens.svg"]
