"""The thin lens against its equations, worked examples, and rays traced through an ideal lens."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import jn_zeros

import simulator
from simulator.errors import PhotositeError
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.pupil import Aperture
from simulator.optics.pupil.vignetting import RoundStop, Vignetting

CHART = Path(__file__).parents[3] / "configs" / "shots" / "color_checker.yaml"
LENSES = [ThinLens(50.0, 1.8, 2.0), ThinLens(4.2, 2.0, 0.15), ThinLens(105.0, 4.0, 0.31), ThinLens(24.0, 11.0)]


def spot_um(lens: ThinLens, depth_m: float) -> float:
    """Diameter of the spot of a point on the axis, by rays: an ideal lens turns a ray at height y by y / f."""
    heights_mm = np.linspace(-0.5, 0.5, 11) * lens.focal_length_mm / lens.f_number
    slopes = heights_mm / (depth_m * 1e3) - heights_mm / lens.focal_length_mm
    sensor_mm = 1.0 / (1.0 / lens.focal_length_mm - 1.0 / (lens.focus_distance_m * 1e3))
    return 1e3 * float(np.ptp(heights_mm + sensor_mm * slopes))


def test_lens_equation():
    lens = ThinLens(50.0, 2.0, 2.0)
    assert 1 / lens.image_distance_mm + 1 / 2000.0 == pytest.approx(1 / 50.0)
    assert lens.magnification == pytest.approx(50.0 / (2000.0 - 50.0))


def test_blur_circle_of_a_worked_example():
    """R18: 50 mm f/1.8 at 2 m, object at 4 m: diameter 0.35613 mm."""
    assert 2e-3 * ThinLens(50.0, 1.8, 2.0).blur_radius_um(4.0) == pytest.approx(0.35613, rel=1e-4)


def test_blur_is_linear_in_the_inverse_distance_and_signed():
    lens = ThinLens(50.0, 1.8, 2.0)
    radii = lens.blur_radius_um(1.0 / np.array([1.0, 0.75, 0.5, 0.25, 0.0 + 1e-300]))
    assert np.allclose(np.diff(radii), radii[1] - radii[0])
    assert radii[0] < 0 and abs(radii[2]) < 1e-9 and lens.blur_radius_um(math.inf) > 0


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("depth_m", [0.12, 0.3, 0.9, 2.0, 7.0, 1e3, math.inf])
def test_blur_circle_is_the_spot_of_traced_rays(lens, depth_m):
    assert 2 * abs(lens.blur_radius_um(depth_m)) == pytest.approx(spot_um(lens, depth_m), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("lens", LENSES[:3])
@pytest.mark.parametrize("circle_um", [3.0, 29.0])
def test_limits_of_the_depth_of_field_are_where_rays_fill_the_circle(lens, circle_um):
    near_m, far_m = lens.depth_of_field_m(circle_um)
    assert near_m < lens.focus_distance_m < far_m
    assert spot_um(lens, near_m) == pytest.approx(circle_um, rel=1e-9)
    assert spot_um(lens, far_m) == pytest.approx(circle_um, rel=1e-9)


@pytest.mark.parametrize("circle_um", [8.0, 29.0])
def test_focused_at_the_hyperfocal_distance_infinity_fills_the_circle(circle_um):
    distance_m = ThinLens(35.0, 8.0).hyperfocal_m(circle_um)
    assert spot_um(ThinLens(35.0, 8.0, distance_m), math.inf) == pytest.approx(circle_um, rel=1e-9)
    assert ThinLens(35.0, 8.0, distance_m * 1.0001).depth_of_field_m(circle_um)[1] == math.inf
    assert ThinLens(35.0, 8.0, distance_m * 0.9999).depth_of_field_m(circle_um)[1] < 1e9
    near_m = ThinLens(35.0, 8.0, distance_m).depth_of_field_m(circle_um)[0]
    assert near_m == pytest.approx(distance_m / 2, rel=1e-12)  # the photographers' rule: half of it


def test_circle_of_confusion_is_a_share_of_the_diagonal_unless_stated():
    assert ThinLens(50.0, 2.0).circle_um(43.2666) == pytest.approx(28.844, abs=1e-3)
    assert ThinLens(50.0, 2.0, circle_of_confusion_um=20.0).circle_um(43.2666) == 20.0


def test_field_of_view_and_full_frame_equivalent():
    lens = ThinLens(50.0, 2.0)
    assert lens.field_of_view_deg(36.0) == pytest.approx(39.598, abs=1e-3)  # 2 atan(18/50)
    assert lens.focal_length_35mm_mm(math.hypot(18.0, 12.0)) == pytest.approx(100.0)
    assert lens.f_number_35mm(math.hypot(18.0, 12.0)) == pytest.approx(4.0)


def test_equivalent_lenses_blur_the_same_share_of_the_picture():
    """25 mm f/1.4 on half the diagonal and 50 mm f/2.8 on 36 mm x 24 mm: one pupil, far subjects."""
    small, full = ThinLens(25.0, 1.4, 1e4), ThinLens(50.0, 2.8, 1e4)
    assert small.blur_radius_um(20.0) / 0.5 == pytest.approx(full.blur_radius_um(20.0), rel=1e-5)


def test_working_f_number_is_image_distance_over_pupil():
    lens = ThinLens(50.0, 2.8, 0.1)  # life size
    assert lens.working_f_number == pytest.approx(5.6)
    assert lens.working_f_number == pytest.approx(lens.image_distance_mm / lens.pupil_diameter_mm)


def test_airy_disk():
    """R19: 5.368 um at f/4 and 550 nm with the constant 2.44; its true value is 2 x 3.8317 / pi."""
    assert ThinLens(50.0, 4.0).airy_diameter_um() == pytest.approx(2 * jn_zeros(1, 1)[0] / math.pi * 0.55 * 4, rel=1e-12)
    assert ThinLens(50.0, 4.0).airy_diameter_um(550.0) == pytest.approx(5.368, rel=1e-3)


def test_t_stop_states_the_transmittance():
    stated, passed = ThinLens(50.0, 2.0, t_stop=2.2), ThinLens(50.0, 2.0, transmittance=(2.0 / 2.2) ** 2)
    assert stated.irradiance_per_radiance_sr() == passed.irradiance_per_radiance_sr()
    assert passed.t_number == pytest.approx(2.2)
    assert ThinLens(50.0, 2.0).t_number == 2.0


def test_a_shot_file_states_t_stop_blades_and_circle():
    settings = {"lens.t_stop": 4.2, "lens.aperture": {"blades": 7, "rotation": "10 deg"}, "lens.circle_of_confusion": "20 um"}
    shot = simulator.load_shot(CHART, settings)
    assert (shot.lens.t_stop, shot.lens.aperture, shot.lens.circle_of_confusion_um) == (4.2, Aperture(7, 10.0), 20.0)
    assert shot.lens.pupil.area() == pytest.approx(math.pi)
    assert shot.resolved["lens"]["aperture"] == {"blades": 7, "rotation": "10 deg", "blade_curvature": 0.0}
    with pytest.raises(PhotositeError, match="--set lens.aperture.*lens.aperture.blades = 2: give 3 to 32"):
        simulator.load_shot(CHART, {"lens.aperture": {"blades": 2}})


def test_a_t_stop_is_written_as_it_is_shown():
    """As T/4.2 in files, messages and tables; other lens numbers are no T-stops."""
    shot = simulator.load_shot(CHART, {"lens.t_stop": "T/4.2"})
    assert shot.lens.t_stop == 4.2 and shot.resolved["lens"]["t_stop"] == "T/4.2"
    with pytest.raises(PhotositeError, match="lens.f_number = T/4.2: is a T-stop; an f-number such as f/2.8 is wanted here"):
        simulator.load_shot(CHART, {"lens.f_number": "T/4.2"})


def test_a_shot_file_states_the_rims():
    settings = {"lens.vignetting": {"front": {"distance": "3 cm", "diameter": "44 mm"}}}
    shot = simulator.load_shot(CHART, settings)
    assert shot.lens.vignetting == Vignetting(front=RoundStop(30.0, 44.0))
    settings["lens.vignetting"]["front"]["diameter"] = "1 mm"
    with pytest.raises(PhotositeError, match="--set lens.vignetting.*lens.vignetting.front.diameter = 1 mm: narrower"):
        simulator.load_shot(CHART, settings)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"focal_length_mm": 0.0}, "lens.focal_length = 0"),
        ({"focal_length_mm": math.nan}, "lens.focal_length = nan"),
        ({"focal_length_mm": math.inf}, "lens.focal_length = inf"),
        ({"f_number": 0.4}, "lens.f_number .*f/0.5"),
        ({"f_number": math.inf}, "lens.f_number = f/inf"),
        ({"focus_distance_m": 0.05}, "lens.focus_distance .*0.05 m"),
        ({"focus_distance_m": math.nan}, "lens.focus_distance"),
        ({"transmittance": 1.2}, "lens.transmittance"),
        ({"t_stop": 1.9}, "lens.t_stop = T/1.9: glass passes no more .* give 2 or more"),
        ({"t_stop": 2.2, "transmittance": 0.8}, "lens.t_stop = T/2.2: .*leave lens.transmittance out"),
        ({"circle_of_confusion_um": 0.0}, "lens.circle_of_confusion = 0.0 um: give a diameter above 0"),
    ],
)
def test_impossible_lenses_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=message):
        ThinLens(**{"focal_length_mm": 50.0, "f_number": 2.0} | arguments)
