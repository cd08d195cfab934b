"""Exposures of one frame follow each other on the clock: flicker and shutter differ, and what cannot open twice is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker
from simulator.exposure.later_exposures import later_exposures
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import GlobalShutter, RollingShutter
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

TABLE = {100: IsoSetting(1.0, 1.0)}
CAMERA = small_camera(32, 24, bit_depth=12, black_level_dn=64.0, iso_table=TABLE, hdr_readout=HdrReadout((1.0, 0.25, 0.0625)))


def take(exposure: Exposure, camera=CAMERA, light=1.0, **settings):
    shot = Shot(band_scene(np.full((24, 32), light), np.inf), ThinLens(50.0, 8.0, cos4=False), exposure, camera, **settings)
    return shot, simulate(shot)


def test_each_begins_when_the_one_before_ends():
    found = later_exposures(Exposure(0.016, start_s=2.0), CAMERA)
    assert [(one.start_s, one.time_s) for one in found] == [(2.016, 0.004), (2.02, 0.001)]


def test_light_at_rest_is_computed_once():
    shot, _ = take(Exposure(0.016, shutter=RollingShutter(0.02)))
    planned = plan(shot)
    assert planned.later == ()
    assert "3 readings of 3 exposures, combined" in next(one for one in planned.passes if one.name == "sensor").method
    assert not any(one.name == "later exposures" for one in planned.passes)
    assert {"hdr read-out", "companding"} <= {step.stage for step in planned.steps}
    without = plan(replace(shot, camera=replace(CAMERA, hdr_readout=None)))
    assert [one.name for one in without.passes] == [one.name for one in planned.passes]
    assert not any("hdr" in step.stage or "companding" in step.stage for step in without.steps)


def test_flicker_differs_from_exposure_to_exposure():
    """1 + m cos(2 pi f t): the integral over each exposure's own time, in the exposure whose reading is used."""
    exposure = Exposure(0.016, flicker=MainsFlicker(100.0, 0.5))
    _, steady = take(replace(exposure, flicker=None), light=1e-3)
    gain = 1000.0 / float(steady.mean_electrons.mean())  # to 1000 electrons in the long exposure
    for wanted, (begin, end) in ((1000.0, (0.0, 0.016)), (8000.0, (0.016, 0.02)), (40000.0, (0.02, 0.021))):
        _, flickers = take(exposure, light=1e-3 * gain * wanted / 1000.0)
        mean = 1.0 + 0.5 * (np.sin(200 * np.pi * end) - np.sin(200 * np.pi * begin)) / (200 * np.pi * (end - begin))
        np.testing.assert_allclose(flickers.noise_free_dn - 64.0, wanted * mean, rtol=2e-5)


def test_strips_and_a_cache_of_light_change_no_bit_and_files_tell_when_each_exposure_began():
    exposure, cache = (
        Exposure(0.016, start_s=0.003, shutter=RollingShutter(0.02), flicker=MainsFlicker(100.0, 0.5)),
        LightCache(),
    )
    camera = replace(CAMERA, stages={"photon_shot_noise": PhotonShotNoise()})
    shot, whole = take(exposure, camera, 3.0, truth=("variance", "rgb"))
    assert [one.name for one in plan(shot).passes if one.name == "later exposures"] == ["later exposures"]
    for again in (simulate(shot, strip_px=300), simulate(shot, cache=cache), simulate(shot, cache=cache)):
        for name in ("dn", "mean_electrons", "noise_free_dn"):
            np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
        np.testing.assert_array_equal(again.truth["variance"], whole.truth["variance"])
        np.testing.assert_array_equal(again.truth["rgb"], whole.truth["rgb"])
    assert cache.reused > 0
    assert [one["release_s"] for one in whole.resolved["later_times"]] == pytest.approx([0.019, 0.023])
    assert {one["step_s"] for one in whole.resolved["later_times"]} == {whole.resolved["times"]["step_s"]}


def test_truth_knows_the_light_of_each_exposure():
    """Variance of the short exposure's own electrons, scaled: 16^2 (n / 16 + 1 + 1/12) with its share of the flicker."""
    camera = replace(CAMERA, stages={"photon_shot_noise": PhotonShotNoise()})
    _, steady = take(Exposure(0.016), camera, 1e-3)
    gain = 40000.0 / float(steady.mean_electrons.mean())
    _, raw = take(Exposure(0.016, flicker=MainsFlicker(100.0, 0.5)), camera, 1e-3 * gain, truth=("variance",))
    short_e = (raw.noise_free_dn - 64.0) / 16.0
    np.testing.assert_allclose(raw.truth["variance"], 256.0 * (short_e + 1.0 + 1 / 12), rtol=2e-3)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"flash": Flash(0.001, guide_number_m=2.0)}, "exposure.flash = given: fires in one exposure only"),
        ({"shutter": GlobalShutter(1e-4, 0.01)}, "exposure.shutter = given: only a rolling shutter opens several times"),
    ],
)
def test_what_cannot_open_several_times_is_refused(settings, message):
    with pytest.raises(PhotositeError, match=re.escape(message)):
        later_exposures(Exposure(0.016, **settings), CAMERA)
    dual = replace(CAMERA, iso_table={25: TABLE[100], 100: IsoSetting(4.0, 1.0)}, hdr_readout=HdrReadout(gains=(1.0, 0.25)))
    assert later_exposures(Exposure(0.016, **settings), dual) == []
