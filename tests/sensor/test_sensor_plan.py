"""The least noise of an exposure, which the accuracy of the optics refers to, belongs to the camera and not to the ISO."""

import math
from dataclasses import replace

import pytest
from helpers.camera_builders import small_camera

from simulator.config import load_camera
from simulator.optics.lens.relative_illumination import plan_irradiance
from simulator.optics.lens.thin_lens import ThinLens
from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan, plan_sensor
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.full_well import FullWell

CAMERAS = ("canon_5d_mark_iv", "ideal", "imx385", "nikon_d850", "sony_a7s2")


def planned(camera: Camera, iso: float, time_s: float = 0.01) -> SensorPlan:
    irradiance = plan_irradiance(ThinLens(50.0, 2.0), camera.pixel_pitch_um, camera.width_px, camera.height_px)
    return plan_sensor(camera, (irradiance, Integration(time_s, camera.pixel_pitch_um**2)), iso, time_s)


@pytest.mark.parametrize("name", CAMERAS)
def test_no_iso_has_less_noise_than_the_floor_and_all_have_the_same(name):
    camera = load_camera(name)
    first, last = camera.isos[0], camera.isos[-1]
    between = [math.sqrt(low * high) for low, high in zip(camera.isos[:-1], camera.isos[1:], strict=True)]
    if camera.conversion_gain is not None:  # nothing was measured on both sides of the switch
        between = [iso for iso in between if not 0.5 < iso / camera.conversion_gain.iso < 2.0]
    plans = [planned(camera, iso) for iso in (*camera.isos, *between)]
    floor = plans[0].noise_floor()
    assert all(one.noise_floor() == floor for one in plans), (first, last)
    for one in plans:
        assert one.electrons_at_white() <= floor.most_electrons
        assert one.moments(0.0).variance / one.gain_dn_per_e() ** 2 >= floor.read_noise_e**2
    # and it is no lower than rounding makes it
    assert max(one.electrons_at_white() for one in plans) > 0.5 * floor.most_electrons
    least = min(one.moments(0.0).variance / one.gain_dn_per_e() ** 2 for one in plans)
    assert least < 2.0 * floor.read_noise_e**2


def test_bit_depth_and_gain_leave_the_floor_of_a_photosite_whose_well_is_the_limit():
    """Photosites of 60,000 e- whose noise of 3 e- arises before the gain; the ADC ends above the well and rounds finely."""
    from simulator.sensor.camera.read_noise_model import ReadNoiseModel

    well = {"full_well": FullWell(60000.0)}
    cameras = [
        small_camera(
            bit_depth=depth,
            stages=well,
            iso_table={},
            read_noise_model=ReadNoiseModel(gain * 2.0 ** (depth - 14), 3.0, 0.0, 100, 6400),
        )
        for depth in (14, 16)
        for gain in (0.2, 0.25)
    ]
    assert {planned(camera, 800).noise_floor() for camera in cameras} == {
        NoiseFloor(65536.0, math.sqrt(8.0), has_shot_noise=False)
    }


def test_a_sensor_that_dark_current_fills_has_no_floor_and_longer_exposures_have_more_noise():
    camera = small_camera(stages={"full_well": FullWell(100.0), "dark_current": DarkCurrent(1e6)})
    assert planned(camera, 100, 1.0).noise_floor() is None
    warm = replace(camera, stages={"dark_current": DarkCurrent(100.0)})
    assert [planned(warm, 100, time_s).noise_floor().read_noise_e for time_s in (1.0, 4.0)] == [8.0, 16.0]


def test_wells_that_dark_current_fills_leave_no_electrons_but_the_gain():
    """An hour at 100 e-/s in wells of 60,000 e-: no light can be told, at any ISO; `explain` says so."""
    from simulator.pipeline.explain.noise_budget import noise_budget

    stages = {"dark_current": DarkCurrent(100.0), "full_well": FullWell(60000.0)}
    full = planned(small_camera(stages=stages), 100, 3600.0)
    assert full.electrons_at_white() == 0.0 and full.gain_dn_per_e() == pytest.approx(1.0)
    assert full.noise_floor() is None
    budget = noise_budget(full, 500.0, 100, 3600.0)
    assert budget.is_clipped and budget.dynamic_range_stops == -math.inf
    nearly = planned(small_camera(stages=stages), 100, 599.0)
    assert nearly.electrons_at_white() == pytest.approx(100.0)
