"""The plan: what is skipped, why, and numbers that people and kernels read."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import STAGE_NUMBERS, every_stage, small_camera
from helpers.scene_builders import FixedScene, band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.kernel.kernel_program import sensor_defines
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import fields_from_shot

LENS = ThinLens(50.0, 2.0, 2.0, cos4=False)


def shot(depth_m=2.0, camera=None, lens=LENS) -> Shot:
    return Shot(band_scene(np.ones((8, 8)), depth_m), lens, Exposure(0.01), camera or small_camera())


def kept(planned) -> dict[str, bool]:
    return {step.stage: step.kept for step in planned.steps}


def test_a_scene_in_focus_has_no_defocus_and_a_blurred_one_has():
    assert not kept(plan(shot(2.0)))["defocus"]
    assert kept(plan(shot(8.0)))["defocus"]


@pytest.mark.parametrize(("k1", "way"), [(-0.1, "inwards"), (0.1, "outwards")])
def test_a_distortion_says_which_way_the_corner_moves(k1, way):
    """By a tenth of the half diagonal, which is 40 photosites."""
    lens = dataclasses.replace(LENS, distortion=Distortion(k1, unit="half_diagonal"))
    (step,) = (step for step in plan(shot(lens=lens, camera=small_camera(64, 48))).steps if step.stage == "distortion")
    assert step.why.startswith(f"the corner moves 4.0 photosites {way}, traced back in")


def test_stages_that_the_camera_lacks_are_skipped_with_a_reason():
    planned = plan(shot())
    assert not kept(planned)["photon_shot_noise"] and not kept(planned)["read_noise_after_gain"]
    assert all(step.why for step in planned.steps)
    assert planned.sensor.stage("photon_shot_noise") is None


def test_read_noise_is_split_so_that_the_measured_total_comes_out():
    camera = small_camera(iso_table={100: IsoSetting(0.5, 3.0)}, read_noise_after_gain_dn=1.0)
    planned = plan(shot(camera=camera))
    assert planned.sensor.stage("read_noise_before_gain").sigma_e == pytest.approx(math.sqrt(8.0) / 0.5)
    assert planned.sensor.moments(0.0).variance == pytest.approx(9.0 + 1 / 12)


def test_noise_profile_is_gain_over_span_and_dark_variance_over_span_squared():
    stages = {"photon_shot_noise": STAGES["photon_shot_noise"]()}
    camera = small_camera(bit_depth=14, black_level_dn=512.0, iso_table={100: IsoSetting(0.5, 3.0)}, stages=stages)
    slope, offset = plan(shot(camera=camera)).sensor.noise_profile()
    span = 16383 - 512
    assert slope == pytest.approx(0.5 / span)
    assert offset == pytest.approx((9.0 + 1 / 12) / span**2)


def test_numbers_of_a_stage_are_parameters_and_need_no_new_build():
    """Another ISO changes the array, not the source."""
    first, second = (
        sensor_defines(plan(shot(camera=small_camera(iso_table={100: IsoSetting(gain, 2.0)}))).sensor.stages)
        for gain in (1.0, 2.0)
    )
    assert first[0] == second[0]
    assert not np.array_equal(first[1], second[1])


def test_streams_of_random_numbers_differ_by_stage():
    defines, _ = sensor_defines(plan(shot()).sensor.stages)
    streams = [value for name, value in defines.items() if name.endswith("_STREAM")]
    assert len(set(streams)) == len(streams) and "0u" not in streams


def test_a_response_that_does_not_fit_the_filter_is_refused():
    from simulator.errors import PhotositeError

    mono = small_camera()
    with pytest.raises(PhotositeError, match="response"):
        plan(shot(camera=small_camera(cfa="RGGB", response=mono.response)))


def test_the_scene_is_read_once():
    class Counted(FixedScene):
        loads = 0

        def load(self):
            self.loads += 1
            return super().load()

    scene = Counted(band_scene(np.ones((8, 8))).scene)
    plan(Shot(scene, LENS, Exposure(0.01), small_camera()))
    assert scene.loads == 1


SWITCHES = [(stem, name) for stem in sorted(STAGE_NUMBERS) for name in STAGES[stem].neutral]


@pytest.mark.parametrize(("stem", "name"), SWITCHES)
def test_a_stage_that_would_change_nothing_is_skipped(stem, name):
    """A field at its neutral value; one that follows from the shot is set in the stage alone."""
    stage = every_stage()[stem]
    assert stage.has_effect
    idle = dataclasses.replace(stage, **{name: stage.neutral[name]})
    assert not idle.has_effect
    if name not in fields_from_shot(type(stage)):
        assert plan(shot(camera=small_camera(stages={stem: stage}))).sensor.stage(stem) is not None
        assert plan(shot(camera=small_camera(stages={stem: idle}))).sensor.stage(stem) is None
