"""The truth of a moving shot: where the camera is, and how far what each pixel sees moves until the next frame."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import open_at_once
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.motion_truth import pose_facts
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.truth_exr import read_twin, write_twin
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import Window

PANNING = Motion(SteadyMotion(pan_deg_per_s=1.0, roll_deg_per_s=-5.0), flow_time_s=0.04)
LENS = ThinLens(20.0, 8.0, cos4=False)


def shot_of(motion=PANNING, camera=None, **settings):
    camera, exposure = camera or small_camera(), Exposure(0.01, start_s=0.5)
    return Shot(band_scene(np.ones((48, 64)), 2.0), LENS, exposure, camera, truth=("flow",), motion=motion, **settings)


def flow_of(shot):
    return simulate(shot).truth["flow"]


def test_the_pose_is_that_in_the_middle_of_the_exposure():
    facts = pose_facts(Exposure(0.01, start_s=0.5), PANNING, (open_at_once(0.01),))
    assert facts["mid_exposure_s"] == pytest.approx(0.505, rel=1e-12)
    np.testing.assert_allclose(facts["rotation_deg"], [0.0, 0.505, -2.525], rtol=1e-12)
    assert pose_facts(Exposure(0.01), None, (open_at_once(0.01),))["location_m"] == [0.0, 0.0, 0.0]


def test_a_panning_camera_moves_the_picture_as_its_pose_says():
    raw = simulate(shot_of())
    assert raw.resolved["pose"] == pose_facts(Exposure(0.01, start_s=0.5), PANNING, (open_at_once(0.01),))
    first, second = (PANNING.camera_poses(np.array([time_s])).matrices()[0] for time_s in (0.505, 0.545))
    far_px = 1e3 * LENS.image_distance_mm / 5.0
    x, y = np.meshgrid(np.arange(64) + 0.5 - 32, np.arange(48) + 0.5 - 24)
    rays = np.stack([x, -y, np.full_like(x, -far_px)], axis=-1) @ (second.T @ first).T
    expected = np.stack([rays[..., 0], -rays[..., 1]], axis=-1) * (far_px / -rays[..., 2:]) - np.stack([x, y], axis=-1)
    np.testing.assert_allclose(raw.truth["flow"], expected, atol=1e-6)
    assert raw.truth["flow"].dtype == np.float32 and expected[..., 0].min() > 2


def test_a_window_has_the_flow_of_the_whole_frame_and_strips_the_flow_of_one():
    whole = flow_of(shot_of())
    part = flow_of(shot_of(camera=small_camera(window=Window(10, 6, 20, 30))))
    np.testing.assert_array_equal(part, whole[6:36, 10:30])
    np.testing.assert_array_equal(simulate(shot_of(), strip_px=1024).truth["flow"], whole)


def test_flow_is_in_pixels_of_the_frame():
    motion = Motion(layers={0: LayerMotion((Speed(100.0, "px/s"), Speed(-50.0, "px/s")))}, flow_time_s=0.1)
    np.testing.assert_allclose(flow_of(shot_of(motion)), np.broadcast_to([10.0, -5.0], (48, 64, 2)), rtol=1e-6)
    binned = flow_of(shot_of(motion, camera=small_camera(binning=Binning(2, "charge"))))
    np.testing.assert_allclose(binned, np.broadcast_to([5.0, -2.5], (24, 32, 2)), rtol=1e-6)


def test_flow_is_read_back_from_the_file(tmp_path):
    raw = simulate(shot_of())
    write_twin(raw, tmp_path / "a.truth.exr")
    twin = read_twin(tmp_path / "a.truth.exr")
    np.testing.assert_array_equal(np.stack([twin["flow.x"], twin["flow.y"]], axis=-1), raw.truth["flow"])


def test_nothing_moves_without_motion():
    assert not flow_of(shot_of(None)).any()


def test_flow_without_a_time_or_an_image_is_refused():
    with pytest.raises(PhotositeError, match="truth = flow: needs the time to the next frame; add motion.flow_time"):
        shot_of(Motion(SteadyMotion(1.0)))
    with pytest.raises(PhotositeError, match="truth = flow: this lens forms no image"):
        simulate(replace(shot_of(None), lens=BareSensor()))


def test_a_path_that_ends_before_the_next_frame_is_refused_when_it_is_planned(tmp_path):
    (tmp_path / "way.csv").write_text("time_s,x_px\n0,0\n0.52,10\n")
    layer = LayerMotion(path=tmp_path / "way.csv")
    with pytest.raises(PhotositeError, match="motion.layers.0.path = .*way.csv: the path holds .* from 0.5 s to 0.545 s"):
        simulate(shot_of(Motion(layers={0: layer}, flow_time_s=0.04)))
    with pytest.raises(PhotositeError, match="motion.layers.1 = 1: the scene has 1 layers"):
        simulate(shot_of(Motion(layers={1: layer}, flow_time_s=0.04)))


def test_under_a_rolling_shutter_flow_leads_from_line_to_line():
    """A layer that sinks by v photosites a second, read T_row a row: v T / (1 - v T_row) from frame to frame."""
    exposure = Exposure(0.01, shutter=RollingShutter(readout_time_s=0.48))
    motion = Motion(layers={0: LayerMotion((Speed(0.0, "px/s"), Speed(20.0, "px/s")))}, flow_time_s=0.2)
    raw = simulate(replace(shot_of(motion), exposure=exposure))
    np.testing.assert_allclose(raw.truth["flow"][:36, :, 1], 20.0 * 0.2 / (1.0 - 20.0 * 0.01), atol=1e-6)
    assert raw.resolved["pose"]["mid_exposure_s"] == pytest.approx(0.005 + 0.47 / 2)
