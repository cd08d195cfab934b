"""Charts: reflectances as measured, patches where patch_boxes says, nothing silently unused."""

import dataclasses

import colour
import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.photometry import luminance_of_pixels

from simulator.color.spectra import illuminant, luminance_cd_m2
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.quantities import MeasuredFrame, Mtf
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.charts import ChartScene
from simulator.scene.scene import Scene


def inside(scene, box):
    """Pixels of a chart under a relative box."""
    height, width = scene.planes.shape[:2]
    left, top, right, bottom = box
    return scene.planes[round(top * height) : round(bottom * height), round(left * width) : round(right * width)]


def test_color_checker_patches_are_in_order_with_one_plane_each():
    chart = ChartScene("color_checker", luminance_cd_m2=100.0)
    scene, boxes = chart.load(), chart.patch_boxes()
    assert scene.planes.shape == (48, 72, 25) and len(boxes) == 24
    assert scene.interpolation == "nearest" and scene.planes.dtype == np.float32
    for number, box in enumerate(boxes):
        assert (inside(scene, box) == np.eye(25)[number]).all(), number
    assert (scene.planes.sum(axis=2) == 1).all()
    assert scene.planes[..., 24].mean() == pytest.approx(1 - (10 / 12) ** 2)


def test_color_checker_has_the_measured_reflectances_and_luminances():
    scene = ChartScene("color_checker", luminance_cd_m2=100.0, illuminant="D50").load()
    measured = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    grid_nm = scene.wavelengths_nm
    light = colour.SDS_ILLUMINANTS["D50"].copy().align(colour.SpectralShape(380, 780, 5)).values
    spectra = np.stack([patch.values * light for patch in measured.values()])
    lit = Scene(np.eye(24, dtype=np.float32)[np.newaxis], spectra, grid_nm, light)
    white = Scene(np.ones((1, 1, 1), np.float32), light[np.newaxis], grid_nm, light)
    truth = 100.0 * luminance_of_pixels(lit)[0] / luminance_of_pixels(white)[0]
    assert luminance_cd_m2(scene.spectra_w_m2_sr_nm[:24]) == pytest.approx(truth, rel=1e-6)
    assert luminance_cd_m2(scene.spectra_w_m2_sr_nm[24]) == pytest.approx(3.0, rel=1e-6)
    assert luminance_cd_m2(scene.spectra_w_m2_sr_nm[18]) > 88 and list(measured)[18].startswith("white")


def test_grey_ramp_falls_by_half_a_stop_in_one_plane():
    chart = ChartScene("grey_ramp", luminance_cd_m2=200.0, steps=9)
    scene, boxes = chart.load(), chart.patch_boxes()
    assert scene.planes.shape == (72, 108, 1) and len(boxes) == 9
    levels = [np.unique(inside(scene, box)) for box in boxes]
    assert all(level.size == 1 for level in levels)
    assert np.concatenate(levels) == pytest.approx([2 ** (-step / 2) for step in range(9)], rel=1e-6)
    assert scene.planes[0, 0, 0] == pytest.approx(0.03)
    assert luminance_cd_m2(scene.spectra_w_m2_sr_nm[0]) == pytest.approx(200.0)


def test_flat_field_is_uniform_and_has_its_reflectance():
    chart = ChartScene("flat_field", luminance_cd_m2=100.0, reflectance=0.18, illuminant="A")
    scene = chart.load()
    assert np.unique(scene.planes).tolist() == [np.float32(0.18)] and scene.planes.shape[2] == 1
    assert scene.spectra_w_m2_sr_nm[0] / scene.spectra_w_m2_sr_nm[0, 36] == pytest.approx(illuminant("A"))
    assert chart.patch_boxes() == ((0.0, 0.0, 1.0, 1.0),)
    assert ChartScene("flat_field", 1.0).load().planes.min() == 1.0


@pytest.mark.parametrize(
    "chart", [ChartScene("color_checker", 1.0), ChartScene("grey_ramp", 1.0), ChartScene("grey_ramp", 1.0, steps=40)]
)
def test_charts_are_3_to_2_and_boxes_lie_inside_without_overlap(chart):
    height, width = chart.load().planes.shape[:2]
    assert 2 * width == 3 * height
    left, top, right, bottom = np.array(chart.patch_boxes()).T
    assert left.min() > 0 and top.min() > 0 and right.max() < 1 and bottom.max() < 1
    assert (right > left).all() and (bottom > top).all()
    covered = np.zeros((height, width), int)
    for box in chart.patch_boxes():
        edges = np.array(box) * [width, height, width, height]
        assert edges == pytest.approx(np.rint(edges), abs=1e-9)  # whole pixels
        x0, y0, x1, y1 = np.rint(edges).astype(int)
        covered[y0:y1, x0:x1] += 1
    assert covered.max() == 1


def test_depth_and_field_of_view_are_passed_on():
    scene = ChartScene("flat_field", 1.0, depth_m=3.0, field_of_view_deg=20.0).load()
    assert scene.depth_m == 3.0 and scene.field_of_view_deg == 20.0


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"chart": "color_checker", "steps": 5}, "scene.steps = 5: only chart: grey_ramp"),
        ({"chart": "grey_ramp", "reflectance": 0.5}, "scene.reflectance = 0.5: only chart: flat_field"),
        ({"chart": "grey_ramp", "steps": 1}, "give 2 to 40"),
        ({"chart": "slanted_edge", "angle_deg": 50.0}, "scene.angle = 50 deg: give -44 to 44 deg"),
        (
            {"chart": "siemens_star", "angle_deg": 5.0},
            "scene.angle = 5 deg: only chart: slanted_edge uses it, not siemens_star",
        ),
        ({"chart": "slanted_edge", "dark": 0.9}, "scene.dark = 0.9: give less than scene.bright, 0.8"),
        ({"chart": "dead_leaves", "smallest": 0.2}, "scene.smallest = 0.2: give less than scene.largest, 0.1"),
        (
            {"chart": "zone_plate", "width_px": 900},
            "scene.frequency = 600: is more than a period in two of the chart's 900 pixels",
        ),
        ({"chart": "flat_field", "reflectance": 1.5}, "give 0 to 1"),
        ({"chart": "flat_field", "luminance_cd_m2": -1.0}, "scene.luminance"),
        ({"chart": "flat_field", "illuminant": "sun"}, "scene.illuminant"),
        ({"chart": "flat_field", "depth_m": -1.0}, "scene.depth"),
        ({"chart": "flat_field", "field_of_view_deg": 0.0}, "scene.field_of_view"),
    ],
)
def test_bad_settings_name_the_key(settings, says):
    with pytest.raises(PhotositeError, match=says):
        ChartScene(**({"luminance_cd_m2": 1.0} | settings))


def test_step_wedge_has_the_densities_that_are_stated():
    """Each stripe is 10^-D, and its log differs by the step, exactly."""
    chart = ChartScene("step_wedge", luminance_cd_m2=200.0, steps=9, density_step=0.3)
    scene, boxes = chart.load(), chart.patch_boxes()
    levels = [np.unique(inside(scene, box)) for box in boxes]
    assert len(boxes) == 9 and all(level.size == 1 for level in levels)
    assert -np.log10(np.concatenate(levels)) == pytest.approx(0.3 * np.arange(9), abs=1e-6)
    assert np.unique(scene.planes).size == 9 and scene.interpolation == "nearest"
    assert ChartScene("step_wedge", 1.0).wedge_reflectances() == pytest.approx(10.0 ** (-0.15 * np.arange(21)))


@pytest.mark.parametrize("chart", ["slanted_edge", "siemens_star", "zone_plate", "dots", "dead_leaves"])
def test_patterns_are_3_to_2_between_their_two_reflectances(chart):
    own = {"zone_plate": {"frequency": 30.0}, "dead_leaves": {"smallest": 0.02}}.get(chart, {})
    scene = ChartScene(chart, luminance_cd_m2=100.0, width_px=180, bright=0.9, dark=0.1, **own).load()
    assert scene.planes.shape == (120, 180, 1) and scene.interpolation == "bilinear"
    assert 0.1 - 1e-6 <= scene.planes.min() < 0.2 and 0.8 < scene.planes.max() <= 0.9 + 1e-6
    assert luminance_cd_m2(scene.spectra_w_m2_sr_nm[0]) == pytest.approx(100.0)


def test_the_edge_of_a_chart_has_the_mtf_of_the_photosites_aperture():
    """sinc of the photosite along the normal: three of the chart's exact pixels make a photosite, so that its mean is exact."""
    camera = small_camera(96, 64)
    chart = ChartScene("slanted_edge", luminance_cd_m2=100.0, width_px=288, angle_deg=5.7)
    shot = Shot(chart, ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(0.01), camera)
    light = float(simulate(shot).mean_electrons.max())
    shot = dataclasses.replace(shot, exposure=Exposure(0.01 * 60000.0 / light))
    curve = Mtf().measure(MeasuredFrame.from_raw(simulate(shot), shot)).curves["transfer"]
    frequency, angle = np.linspace(0.02, 0.5, 25), np.radians(5.7)
    expected = np.sinc(frequency * np.cos(angle)) * np.sinc(frequency * np.sin(angle))
    assert np.abs(np.interp(frequency, curve.x, curve.y) - expected).max() < 0.012
