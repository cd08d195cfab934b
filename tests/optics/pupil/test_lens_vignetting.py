"""Mechanical vignetting: the open share of the pupil against traced rays, and the light that the sensor loses."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.relative_illumination import illumination_error, plan_irradiance
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.pupil import Aperture
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate

RIMS = Vignetting(RoundStop(30.0, 44.0), RoundStop(20.0, 26.0))
LENSES = [
    ThinLens(50.0, 1.4, vignetting=RIMS),
    ThinLens(50.0, 1.4, 0.4, vignetting=RIMS),
    ThinLens(50.0, 1.8, vignetting=Vignetting(front=RoundStop(25.0, 30.0))),
    ThinLens(50.0, 2.0, vignetting=Vignetting(rear=RoundStop(20.0, 20.0))),
    ThinLens(50.0, 2.8, aperture=Aperture(5, 20.0), vignetting=Vignetting(RoundStop(40.0, 23.0))),
]


def passing(lens: ThinLens, field, points) -> np.ndarray:
    """Which points of the pupil pass a ray to the photosite at this field: traced from the sensor to the scene.

    Axes of the room behind the camera: the photosite lies at -field * image distance. `points` are in the pupil's own
    axes, turned by 180 degrees, in pupil radii. An ideal lens turns a ray at height p by p / f.
    """
    image_mm, rims = lens.image_distance_mm, lens.vignetting
    through_mm = -np.asarray(points) * 0.5 * lens.pupil_diameter_mm
    photosite_mm = -np.asarray(field) * image_mm
    slope = (through_mm - photosite_mm) / image_mm
    passes = np.ones(len(through_mm), bool)
    if rims.rear:
        passes &= np.hypot(*(through_mm - rims.rear.distance_mm * slope).T) <= 0.5 * rims.rear.diameter_mm
    if rims.front:
        slope = slope - through_mm / lens.focal_length_mm
        passes &= np.hypot(*(through_mm + rims.front.distance_mm * slope).T) <= 0.5 * rims.front.diameter_mm
    return passes


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("field", [(0.0, 0.0), (0.25, 0.0), (-0.2, 0.3), (0.1, -0.4)])
def test_the_pupil_passes_the_rays_that_pass_all_rims(lens, field):
    points = np.random.default_rng(1).uniform(-1.4, 1.4, (20000, 2))
    inside = lens.pupil.contains(points)
    assert np.array_equal(lens.pupil.contains(points, field), inside & passing(lens, field, points))


def test_without_rims_nothing_is_lost_and_the_table_is_left_out():
    stage = plan_irradiance(ThinLens(50.0, 1.4), 5.0, 4000, 3000)
    assert stage.vignetting == () and set(stage.kernel_values()) == {
        "effective_solid_angle_sr",
        "tan2_per_px2",
        "centre_x_px",
        "centre_y_px",
    }


@pytest.mark.parametrize("lens", LENSES[:3])
def test_the_sensor_loses_the_clipped_share_of_the_light(lens):
    """Every photosite of a flat field: cos^4 * open area / pi, to 1e-4 of the light on the axis."""
    camera = small_camera(96, 64, pixel_pitch_um=300.0)  # 28.8 mm x 19.2 mm
    distance_m = lens.focus_distance_m
    raw = simulate(Shot(band_scene(np.ones((4, 4)), distance_m), lens, Exposure(1e-6), camera))
    y, x = np.mgrid[:64:7, :96:5]
    tx, ty = (x + 0.5 - 48) * 0.3 / lens.image_distance_mm, (y + 0.5 - 32) * 0.3 / lens.image_distance_mm
    share = np.vectorize(lambda a, b: lens.pupil.area((a, b)) / math.pi)(tx, ty)
    expected = share / (1 + tx**2 + ty**2) ** 2
    plain = simulate(
        Shot(
            band_scene(np.ones((4, 4)), distance_m),
            ThinLens(50.0, lens.f_number, distance_m, cos4=False),
            Exposure(1e-6),
            camera,
        )
    )
    found = raw.mean_electrons[::7, ::5] / plain.mean_electrons[::7, ::5].astype(float)
    assert expected.min() < 0.7 and np.abs(found - expected).max() < 1e-4


def test_with_blades_the_light_is_the_mean_over_directions():
    """Single places differ from it by up to 1.3 % of the light on the axis with five blades; the mean by less than 2e-4."""
    lens, pitch_mm = LENSES[4], 0.35
    stage = plan_irradiance(lens, 1e3 * pitch_mm, 100, 100)
    worst = 0.0
    for radius_px in np.linspace(0.0, 70.0, 12):
        tangent = radius_px * pitch_mm / lens.image_distance_mm
        angles = np.linspace(0, 2 * math.pi, 90, endpoint=False)
        around = [lens.pupil.area((tangent * math.cos(angle), tangent * math.sin(angle))) / math.pi for angle in angles]
        assert np.mean(around) == pytest.approx(stage.relative_illumination(radius_px) * (1 + tangent**2) ** 2, abs=2e-4)
        worst = max(worst, np.abs(around - np.mean(around)).max())
    assert 1e-3 < worst < 0.013


def test_the_darkest_photosite_is_known_to_the_stage():
    lens, camera = LENSES[0], small_camera(96, 64, pixel_pitch_um=300.0)
    planned = plan(Shot(band_scene(np.ones((4, 4)), math.inf), lens, Exposure(1e-6), camera))
    raw = simulate(Shot(band_scene(np.ones((4, 4)), math.inf), lens, Exposure(1e-6), camera))
    ratio = raw.mean_electrons.max() / raw.mean_electrons.min()
    assert ratio <= 1.0 / planned.sensor.stage("irradiance").relative_illumination(math.hypot(48, 32)) < ratio * 1.2


@pytest.mark.parametrize(
    ("rims", "message"),
    [
        (Vignetting(RoundStop(30.0, 30.0)), "lens.vignetting.front.diameter = 30 mm: narrower .* give 35.71 mm or more"),
        (Vignetting(rear=RoundStop(25.0, 10.0)), "lens.vignetting.rear.diameter = 10 mm: narrower .* give 17.86 mm or more"),
        (Vignetting(rear=RoundStop(60.0, 30.0)), "lens.vignetting.rear.distance = 60 mm: lies between .* 50 mm"),
        (Vignetting(RoundStop(-3.0, 40.0)), "lens.vignetting.front.distance = -3 mm"),
        (Vignetting(RoundStop(math.nan, 40.0)), "lens.vignetting.front.distance = nan mm"),
        (Vignetting(RoundStop(3.0, math.nan)), "lens.vignetting.front.diameter = nan mm"),
    ],
)
def test_impossible_rims_are_refused(rims, message):
    with pytest.raises(PhotositeError, match=message):
        ThinLens(50.0, 1.4, vignetting=rims)


@pytest.mark.parametrize("lens", [LENSES[0], LENSES[3], LENSES[4]])
def test_the_table_of_the_clipped_pupil_errs_by_no_more_than_is_stated(lens):
    """Closed-form areas at random places of a full frame, in all directions, against the table that frames read."""
    width, height, pitch_um = 3600, 2400, 10.0
    stage, stated = plan_irradiance(lens, pitch_um, width, height), illumination_error(lens, pitch_um, width, height)
    rng, per_px = np.random.default_rng(1), 1e-3 * pitch_um / lens.image_distance_mm
    places = (rng.random((300, 2)) - 0.5) * (width, height)
    read = np.interp(np.hypot(*places.T) * stage.nodes_per_px, np.arange(len(stage.vignetting)), stage.vignetting)
    truth = [lens.pupil.area(per_px * place) / math.pi for place in places]
    left = np.abs(read - truth).max()
    assert left <= stated < (0.1 if lens.pupil.blades else 1e-3)
    assert illumination_error(ThinLens(50.0, 2.0), pitch_um, width, height) == 0.0
