"""docs/lens.md shows the numbers that the lens has."""

import math
from pathlib import Path

import pytest

from simulator.optics.lens.pinhole import SHARPEST, Pinhole
from simulator.optics.lens.sensor_formats import SENSOR_FORMATS
from simulator.optics.lens.thin_lens import ThinLens

PAGE = (Path(__file__).parents[3] / "docs" / "lens.md").read_text(encoding="utf-8")
LENS, HOLE = ThinLens(50.0, 1.8, 2.0), Pinhole(0.3, 50.0)
DIAGONAL_MM = math.hypot(36.0, 24.0)
CIRCLE_UM = LENS.circle_um(DIAGONAL_MM)
NEAR_M, FAR_M = LENS.depth_of_field_m(CIRCLE_UM)
ACROSS, DOWN, CORNERS = (LENS.field_of_view_deg(extent) for extent in (36.0, 24.0, DIAGONAL_MM))


@pytest.mark.parametrize(
    ("quantity", "value"),
    [
        ("image distance", f"{LENS.image_distance_mm:.3f} mm"),
        ("magnification", f"{LENS.magnification:.5f}"),
        ("pupil diameter", f"{LENS.pupil_diameter_mm:.3f} mm"),
        ("working f-number", f"f/{LENS.working_f_number:.3f}"),
        ("T-stop", f"T/{LENS.t_number:g}"),
        ("field of view", f"{ACROSS:.2f}° × {DOWN:.2f}°, {CORNERS:.2f}°"),
        ("35 mm equivalent", f"{LENS.focal_length_35mm_mm(DIAGONAL_MM):.1f} mm f/{LENS.f_number_35mm(DIAGONAL_MM):.1f}"),
        ("blur circle", f"{2 * LENS.blur_radius_um(4.0):.1f} µm"),
        ("circle of confusion", f"{CIRCLE_UM:.2f} µm"),
        ("depth of field", f"{NEAR_M:.3f} m to {FAR_M:.3f} m"),
        ("hyperfocal distance", f"{LENS.hyperfocal_m(CIRCLE_UM):.2f} m"),
        ("Airy disk", f"{LENS.airy_diameter_um():.3f} µm"),
        ("irradiance per radiance", f"{LENS.irradiance_per_radiance_sr():.5f} sr"),
        ("", f"{ThinLens(50.0, 1.8, 2.0, irradiance='aplanatic').irradiance_per_radiance_sr():.5f} sr"),
        ("blur circle", f"{-2 * HOLE.blur_radius_um(math.inf):.0f} µm"),
        ("diffraction alone", f"{HOLE.airy_diameter_um():.1f} µm"),
        ("irradiance per radiance", f"{HOLE.irradiance_per_radiance_sr() * 1e5:.3f}·10⁻⁵ sr"),
        ("sharpest hole", f"{HOLE.sharpest_diameter_mm():.3f} mm"),
    ],
)
def test_the_page_shows_the_lens_s_numbers(quantity, value):
    lines = [line for line in PAGE.splitlines() if line.startswith(f"| {quantity}".rstrip())]
    assert any(line.endswith(f"| {value} |") for line in lines), value


def test_the_page_names_the_constant_of_the_sharpest_hole():
    assert f"d = {SHARPEST:.3f} √(λ v)" in PAGE


@pytest.mark.parametrize("name", SENSOR_FORMATS)
def test_the_page_lists_the_formats_of_sensors(name):
    shown = SENSOR_FORMATS[name]
    size = f"{shown.width_mm:g} mm × {shown.height_mm:g} mm"
    assert f"| {shown.title} | `{name}` | {size} | {shown.crop_factor:.2f} |" in PAGE


@pytest.mark.parametrize(("focal_length_mm", "angle"), [(17.0, "104°"), (50.0, "47°"), (200.0, "12°")])
def test_the_page_names_the_lecture_s_angles(focal_length_mm, angle):
    assert angle in PAGE and f"{ThinLens(focal_length_mm, 4.0).field_of_view_deg(DIAGONAL_MM):.0f}°" == angle
