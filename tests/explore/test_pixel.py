"""A photosite explained: its numbers are those of the plan, and the patch around it lies on the photon transfer curve."""

from dataclasses import replace

import numpy as np
from helpers.camera_builders import small_camera
from helpers.randomness import accept
from helpers.scene_builders import band_scene
from scipy import stats

from simulator.config import load_shot
from simulator.explore.pixel import explain_pixel, window_at
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise


def explained(shot, x, y):
    again = replace(shot, seeds=replace(shot.seeds, frame=shot.seeds.frame + 1))
    return explain_pixel(shot, plan(shot), simulate(shot), simulate(again), x, y)


def test_the_patch_lies_on_the_transfer_curve_and_the_shares_add_up():
    camera = small_camera(
        96,
        96,
        cfa="RGGB",
        iso_table={100: IsoSetting(0.5, 6.0)},
        black_level_dn=200.0,
        stages={"photon_shot_noise": PhotonShotNoise()},
    )
    shot = Shot(band_scene(np.full((96, 96, 3), 0.5), np.inf), ThinLens(50.0, 8.0, cos4=False), Exposure(0.002), camera)
    found, sensor = explained(shot, 41, 50), plan(shot).sensor
    assert found["color"] == "G" and abs(sum(found["shares"].values()) - 1) < 1e-9
    expected = sensor.moments(found["mean_electrons"])
    transfer = found["transfer"]
    freedom = transfer["photosites"] - 1
    assert transfer["photosites"] == 256
    accept(
        {
            "mean": 2 * stats.norm.sf(abs(transfer["mean_dn"] + 200.0 - expected.mean) / np.sqrt(expected.variance / 512)),
            "variance": 2
            * min(
                stats.chi2.cdf(transfer["variance_dn2"] / expected.variance * freedom, freedom),
                stats.chi2.sf(transfer["variance_dn2"] / expected.variance * freedom, freedom),
            ),
        }
    )
    assert found["mean_dn"] == np.float32(found["mean_dn"]) and abs(found["sigma_dn"] ** 2 - expected.variance) < 1e-9


def test_luminance_is_that_of_a_grey_with_as_many_electrons():
    shot = load_shot("flat_field")
    part = window_at(shot, 0.5, 0.5, 64, 64)
    found = explained(part, 20, 20)
    stated = shot.scene.luminance_cd_m2
    assert abs(found["luminance_cd_m2"] / stated - 1) < 2e-3  # cos^4 at the place of the photosite


def test_a_window_lies_within_the_frame_on_even_places():
    shot = load_shot("color_checker")
    frame = shot.camera.frame
    for at in ((0.0, 0.0), (1.0, 1.0), (0.5, 0.31)):
        window = window_at(shot, *at, 384, 256).camera.window
        assert (window.width, window.height) == (min(384, frame.width), min(256, frame.height))
        assert (window.x - frame.x) % 2 == (window.y - frame.y) % 2 == 0
        assert 0 <= window.x - frame.x <= frame.width - window.width
        assert 0 <= window.y - frame.y <= frame.height - window.height
    tiny = replace(shot, camera=replace(shot.camera, window=Window(10, 20, 100, 50)))
    assert window_at(tiny, 0.9, 0.9, 384, 256).camera.window == Window(10, 20, 100, 50)
