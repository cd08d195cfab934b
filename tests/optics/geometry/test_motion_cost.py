"""The predicted time of motion: each instant has its launches, and lines that open one after the other share instants."""

import dataclasses

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS
from helpers.scene_builders import band_scene

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.optics.geometry.motion_cost import (
    COST_NS,
    instants_cost_ms,
    instants_of,
    moving_cost_ms,
    place_work,
    sweep_cost_ms,
)
from simulator.optics.lens.distortion import Distortion
from simulator.optics.passes.blur_work import moving_work
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot


def planned_shot(**settings):
    """A slope in depth that is blurred at each instant of a pan."""
    slope_m = np.linspace(1.6, 2.4, 32)[None, :].repeat(24, axis=0).astype(np.float32)
    scene = band_scene(np.random.default_rng(1).random((24, 32)), slope_m)
    exposure = Exposure(0.001, **settings)
    return Shot(scene, LENS, exposure, small_camera(32, 24), motion=Motion(camera=SteadyMotion(pan_deg_per_s=40.0)))


def summed(**settings):
    """Plan of it."""
    planned = plan(planned_shot(**settings))
    assert planned.optics.motion is not None and planned.optics.motion.method == "instants"
    return planned


def test_each_instant_has_its_launches():
    motion = summed().optics.motion
    assert motion is not None
    nodes, lines = instants_of(motion, 24)
    assert (nodes, lines) == (motion.count, 24) and nodes > 1
    cost = instants_cost_ms(nodes, 0.0)
    assert cost == pytest.approx(1e-6 * COST_NS["instant"] * nodes)
    assert instants_cost_ms(nodes, 2.0) == pytest.approx(cost + 2.0 * nodes)
    told = next(one.cost_ms for one in summed().passes if one.name == "motion")
    assert told > cost


def test_lines_that_open_one_after_the_other_have_more_instants():
    """Each of which lights a part of the lines."""
    common, rolling = summed().optics.motion, summed(shutter=RollingShutter(0.01)).optics.motion
    assert common is not None and rolling is not None
    nodes, lines = instants_of(rolling, 24)
    assert nodes == len(rolling.shared_nodes()) > rolling.count > 0
    assert 24 * rolling.even_count <= nodes * lines < 24 * nodes and instants_of(common, 24)[1] == 24


def test_an_instant_takes_the_time_of_a_turned_picture():
    """Its places are found one by one, of the light of bands with their margins."""
    planned = summed()
    assert planned.optics.motion is not None
    motion = next(one.cost_ms for one in planned.passes if one.name == "motion")
    still = plan(dataclasses.replace(planned_shot(), motion=None))
    at_rest = next(one.cost_ms for one in still.passes if one.name == "defocus")
    assert motion > 1.2 * at_rest * planned.optics.motion.count


def test_swept_frames_and_moving_points_grow_with_the_photosites():
    small, large = (sweep_cost_ms("sweep", count) for count in (1e4, 1e8))
    assert large - small == pytest.approx(1e-6 * COST_NS["sweep"] * (1e8 - 1e4))
    assert moving_cost_ms(2e6, 0.0) - moving_cost_ms(1e6, 0.0) == pytest.approx(COST_NS["moving points"])
    assert moving_cost_ms(0.0, 2e6) - moving_cost_ms(0.0, 1e6) == pytest.approx(COST_NS["moving tables"])


def test_points_of_few_lines_take_the_time_of_their_tables():
    """Under a rolling shutter a cell of points has few lines, and the host makes as many more tables."""

    def work_of(**settings):
        slope_m = np.linspace(1.6, 2.4, 64)[None, :].repeat(48, axis=0).astype(np.float32)
        scene = band_scene(np.random.default_rng(1).random((48, 64)), slope_m)
        motion = Motion(camera=SteadyMotion(right_m_per_s=1.0))
        exposure = Exposure(0.01, **settings)
        optics = plan(Shot(scene, LENS, exposure, small_camera(64, 48), motion=motion)).optics
        assert optics.motion is not None and optics.motion.method == "joint"
        return moving_work(optics)

    (samples, points, tables), (_, _, rolling_tables) = work_of(), work_of(shutter=RollingShutter(0.1))
    assert rolling_tables > 4.0 * tables > 0.0
    assert points > 48 * 64 and samples["copied samples"] > 48 * 64


def test_samples_take_the_time_of_the_pixels_that_they_touch():
    """A sweep before a blur reads the pixels of a sample, which is upright, not those of its whole photosite, which leans."""
    scene, lens = band_scene(np.ones((48, 64))), dataclasses.replace(LENS, distortion=Distortion(-0.05, unit="half_diagonal"))
    projection = dataclasses.replace(
        plan(Shot(scene, lens, Exposure(0.001), small_camera(64, 48))).optics.projection, nearest=True
    )
    assert projection.taps(1.0, leans=True) == 3 and projection.taps(0.25) == 2
    assert place_work(projection, 1)[1] > 3.0 * place_work(projection, 4)[1]


def pan_cost_ms(lens, side_px):
    """Predicted time of an instant of a pan of a square picture over 512 x 512 photosites."""
    scene = band_scene(np.random.default_rng(1).random((side_px, side_px)))
    motion = Motion(camera=SteadyMotion(pan_deg_per_s=40.0))
    planned = plan(Shot(scene, lens, Exposure(0.001), small_camera(512, 512), motion=motion))
    assert planned.optics.motion is not None and planned.optics.motion.method == "swept"
    return next(one.cost_ms for one in planned.passes if one.name == "motion") / planned.optics.motion.count


def test_displaced_photosites_take_the_time_of_their_places():
    """A pan of squares takes 9 times as long behind distortion as without.

    Of bilinear light, one pixel per photosite, there are 4 places.
    """
    distorted = dataclasses.replace(LENS, distortion=Distortion(-0.05, unit="half_diagonal"))
    assert 6.0 < pan_cost_ms(distorted, 1024) / pan_cost_ms(LENS, 1024) < 12.0
    assert 2.0 < pan_cost_ms(distorted, 512) / pan_cost_ms(distorted, 400) < 3.5


def test_rows_take_the_time_of_what_is_read_along_them():
    """Blends of squares that of their pixels: 2.7 times as long of 3 as of 1.02; light between pixels 5 times that of one."""
    assert 2.2 < pan_cost_ms(LENS, 1536) / pan_cost_ms(LENS, 522) < 3.3
    assert 3.5 < pan_cost_ms(LENS, 358) / pan_cost_ms(LENS, 512) < 6.5
