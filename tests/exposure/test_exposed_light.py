"""Light over time in whole frames: each row has its own integral, in crops, strips and binned frames, and in all truth."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept, counts_p, mean_p

from simulator.exposure.exposed_light import plan_exposure
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import CurtainShutter, FirstCurtainShutter, GlobalShutter, LeafShutter, RollingShutter
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.explain.grey_patch import grey_patch
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.arrays import scene_from_rgb
from simulator.scene.charts import ChartScene
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

WALL = scene_from_rgb(np.ones((4, 6), np.float32), luminance_cd_m2=40.0, depth_m=2.0)
LENS = ThinLens(50.0, 4.0, 2.0, cos4=False)
CAMERA = small_camera(40, 200)
FLICKER = MainsFlicker(100.0, 0.4, 20.0)
ROLLING = Exposure(0.002, start_s=0.7, shutter=RollingShutter(0.02), flicker=FLICKER)
FLASH = Flash(0.0005, 0.0005, guide_number_m=2.0, delay_s=-0.01)


def take(exposure: Exposure, camera: Camera = CAMERA, scene: Any = WALL, strip_px: int = 2**25, **settings: Any):
    return simulate(Shot(scene, LENS, exposure, camera, **settings), strip_px=strip_px)


def plain(time_s: float = 0.002) -> float:
    """Mean electrons of the wall without shutter and flicker."""
    return float(take(Exposure(time_s)).mean_electrons.mean())


def test_every_row_has_the_mean_of_the_lamp_over_its_own_interval():
    rows = 0.7 + np.arange(200) * 1e-4
    light = 1.0 + 0.4 * np.sinc(0.2) * np.cos(2 * np.pi * 100.0 * (rows + 0.001) + np.pi / 9)
    frame = take(ROLLING).mean_electrons
    np.testing.assert_allclose(frame, plain() * light[:, None].repeat(40, axis=1), rtol=3e-6)
    assert frame.mean(dtype=np.float64) == pytest.approx(plain(), rel=1e-6)  # 20 ms are two periods: light is conserved


def test_columns_are_lines_where_they_are_scanned():
    camera, flicker = small_camera(200, 20), replace(FLICKER, phase_deg=0.0)
    frame = take(Exposure(0.002, shutter=RollingShutter(0.02, "right_to_left"), flicker=flicker), camera).mean_electrons
    starts = np.arange(200)[::-1] * 1e-4
    light = 1.0 + 0.4 * np.sinc(0.2) * np.cos(2 * np.pi * 100.0 * (starts + 0.001))
    np.testing.assert_allclose(frame, plain() * light[None, :].repeat(20, axis=0), rtol=3e-6)


def test_counts_of_rows_are_poisson_of_their_own_means():
    raw = take(ROLLING, replace(CAMERA, width_px=400, stages={"photon_shot_noise": PhotonShotNoise()}))
    means = raw.mean_electrons[:, 0]
    rows = [0, 40, 90, 150]
    p_values = {("counts", row): counts_p(raw.dn[row], means[row]) for row in rows}
    p_values |= {("mean", row): mean_p(raw.dn[row], means[row], means[row]) for row in rows}
    accept(p_values)
    assert np.ptp(means[rows]) > 0.3 * means.mean()


@pytest.mark.parametrize(
    "exposure",
    [ROLLING, replace(ROLLING, flash=FLASH), replace(ROLLING, shutter=FirstCurtainShutter(0.02, 0.0185))],
    ids=["lamp", "lamp and flash", "first curtain"],
)
def test_windows_strips_and_binned_frames_are_those_of_the_whole(exposure):
    picture = np.random.default_rng(3).uniform(0.1, 1.0, (100, 20)).astype(np.float32)
    scene = scene_from_rgb(picture, luminance_cd_m2=40.0, depth_m=2.0)
    whole = take(exposure, scene=scene)
    window = take(exposure, replace(CAMERA, window=Window(6, 61, 20, 70)), scene)
    np.testing.assert_array_equal(window.dn, whole.dn[61:131, 6:26])
    strips = take(exposure, CAMERA, scene, strip_px=40 * 64)
    np.testing.assert_array_equal(strips.mean_electrons, whole.mean_electrons)
    binned = take(exposure, replace(CAMERA, binning=Binning(2, "average")), scene).mean_electrons
    np.testing.assert_allclose(binned, whole.mean_electrons.reshape(100, 2, 20, 2).mean(axis=(1, 3)), rtol=2e-6)


def test_the_truth_of_a_colour_has_the_rows_too():
    raw = take(replace(ROLLING, flash=FLASH), truth=("rgb",))
    clean = raw.truth["rgb"][..., 0]
    np.testing.assert_allclose(clean * raw.white_level_dn, raw.noise_free_dn, rtol=1e-5)
    assert np.ptp(clean[:, 0]) > 0.2 * clean.mean()


@pytest.mark.parametrize("shutter", [RollingShutter(0.02), CurtainShutter(0.004, 10.0, 1.0), LeafShutter(0.0, 0.0)])
def test_in_steady_light_the_frame_has_the_bits_of_a_global_shutter(shutter):
    exposure = Exposure(0.01, shutter=shutter)
    np.testing.assert_array_equal(take(exposure).dn, take(Exposure(0.01)).dn)
    planned = plan(Shot(WALL, LENS, exposure, CAMERA))
    assert planned.exposed.is_plain
    assert not next(one for one in planned.passes if one.name == "line exposure").kept
    assert not next(step for step in planned.steps if step.stage == "shutter").kept


def test_light_that_all_lines_see_alike_costs_no_pass():
    """A leaf's efficiency, a flicker under a global shutter, and a flash within the exposure are in the scene's spectra."""
    leaf = take(Exposure(0.002, shutter=LeafShutter(0.001, 0.001)))
    np.testing.assert_allclose(leaf.mean_electrons, 0.5 * plain(), rtol=1e-6)
    chart = Shot(ChartScene("flat_field", 40.0), LENS, Exposure(0.002, shutter=LeafShutter(0.001, 0.001)), CAMERA)
    planned = plan(chart)
    white = grey_patch(chart, planned.optics.scene, 1.0, planned.exposed.components[0].most)
    assert white is not None
    np.testing.assert_allclose(simulate(chart).mean_electrons, white.electrons[0], rtol=1e-5)
    exposure = Exposure(
        0.01, shutter=CurtainShutter(0.004), flicker=MainsFlicker(100.0, 0.4), flash=replace(FLASH, delay_s=0.0, decay_s=0.0)
    )
    exposed = plan_exposure(exposure, CAMERA, 4.0, 4.0)
    assert len(exposed.components) == 2 and not exposed.varies and not exposed.is_split


def test_the_ghost_of_a_global_shutter_is_a_ramp_over_the_rows():
    frame = take(Exposure(0.002, shutter=GlobalShutter(0.001, 0.1))).mean_electrons
    ghost = 0.001 * np.arange(200) * 5e-4 / 0.002
    np.testing.assert_allclose(frame[:, 3] / plain() - 1.0, ghost, atol=2e-6)


def test_a_first_curtain_that_does_not_match_darkens_one_end():
    frame = take(Exposure(0.004, shutter=FirstCurtainShutter(0.004, 0.003))).mean_electrons
    opened = 0.004 + 0.5 * 0.001 - (np.arange(200) + 0.5) / 200 * 0.001
    np.testing.assert_allclose(frame[:, 3], plain(0.004) * opened / 0.004, rtol=3e-6)


def test_a_lamp_that_is_off_all_the_time_leaves_the_frame_dark():
    raw = take(Exposure(0.001, flicker=PwmLamp(100.0, 0.1), start_s=0.005))
    assert raw.mean_electrons.max() == 0.0


def test_weights_of_intervals_add_up_to_what_lines_collect():
    exposed = plan_exposure(replace(ROLLING, flash=FLASH), CAMERA, 4.0, 4.0)
    for component in exposed.components:
        begin, end = component.span_s
        weights = np.diff(component.collected(np.linspace(begin, end, 50)), axis=1)
        assert (weights >= -1e-12).all()
        np.testing.assert_allclose(weights.sum(axis=1), component.collected(), atol=2e-6 * component.most)


def times(exposure: Exposure, camera: Camera = CAMERA) -> dict[str, Any]:
    found = take(exposure, camera).resolved["times"]
    assert isinstance(found, dict)
    return found


def test_the_settings_beside_a_frame_hold_the_time_of_each_of_its_rows():
    window = replace(CAMERA, window=Window(0, 20, 40, 30))
    assert times(Exposure(0.01)) == {"release_s": 0.0, "lines": "all", "start_s": 0.0, "step_s": 0.0, "duration_s": 0.01}
    rolling = times(ROLLING, window)
    assert rolling == {
        "release_s": 0.7,
        "lines": "rows",
        "first_line": 20,
        "start_s": pytest.approx(0.002),
        "step_s": pytest.approx(1e-4),
        "duration_s": 0.002,
    }
    upwards = times(replace(ROLLING, shutter=RollingShutter(0.02, "bottom_to_top")), window)
    assert upwards["step_s"] == pytest.approx(-1e-4) and upwards["start_s"] == pytest.approx(0.0179)
    curved = times(Exposure(0.01, shutter=FirstCurtainShutter(0.004, 0.004, acceleration_m_per_s2=100.0)), window)
    assert len(curved["duration_s"]) == 30 and curved["step_s"] == pytest.approx(0.004 / 200)
    curtains = times(Exposure(0.01, shutter=CurtainShutter(0.004, 100.0)), window)
    assert len(curtains["start_s"]) == 30 and curtains["duration_s"] == 0.01 and "step_s" not in curtains
