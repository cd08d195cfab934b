"""A body of combined photosites has the means and variances of the mean codes of the body it was made of."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.neighbors import binned
from helpers.randomness import accept
from helpers.scene_builders import band_scene
from scipy import stats

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.combined_photosites import combine_photosites
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.camera.read_noise_model import ReadNoiseModel
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.banding import Banding
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.hot_pixels import HotPixels
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.random_telegraph_noise import RandomTelegraphNoise
from simulator.sensor.stages.row_noise import RowNoise

LENS = ThinLens(50.0, 8.0, cos4=False)
SIDE = 4


def flat(camera, side=1, iso=100, frame=0):
    """A shot of even light with this body, or with that of its combined photosites."""
    body = combine_photosites(camera, side)
    picture = np.full((body.height_px, body.width_px), 0.5)
    return Shot(band_scene(picture, np.inf), LENS, Exposure(0.005, iso), body, Seeds(frame=frame))


@pytest.mark.parametrize("name", ["sony_a7s2", "nikon_d850", "canon_550d", "imx385"])
def test_moments_of_a_shipped_camera_are_those_of_the_mean_of_its_codes(name):
    camera = replace(load_camera(name), window=Window(0, 0, 32, 32))
    codes = 2.0 ** (16 - camera.bit_depth)
    for iso in camera.isos[:: max(1, len(camera.isos) // 3)]:
        one, mean = (plan(flat(camera, side, iso)).sensor for side in (1, 8))
        rows_dn = camera.iso_setting(iso).row_noise_dn  # 8 rows are averaged, not 64 photosites
        for electrons in (0.0, 3.0, 0.4 * one.electrons_at_white()):
            single, combined = one.moments(electrons), mean.moments(64 * electrons)
            assert combined.mean == pytest.approx(codes * single.mean, rel=1e-9)
            expected = (single.variance - 1 / 12 - rows_dn**2) / 64 + rows_dn**2 / 8
            assert combined.variance == pytest.approx(codes**2 * expected + 1 / 12, rel=1e-9)


NOISY = {
    "photon_shot_noise": PhotonShotNoise(),
    "prnu": Prnu(0.05),
    "dsnu": Dsnu(8.0),
    "dark_current": DarkCurrent(4000.0),
    "random_telegraph_noise": RandomTelegraphNoise(0.02, 60.0),
}
TABLE = {"iso_table": {100: IsoSetting(0.5, 12.0)}, "read_noise_after_gain_dn": 6.0}
MODEL = {"read_noise_model": ReadNoiseModel(0.5, 20.0, 6.0, 100, 200)}


@pytest.mark.parametrize("noise", [TABLE, MODEL], ids=["table", "model"])
def test_codes_have_mean_and_variance_of_the_mean_of_the_codes_of_a_large_frame(noise):
    defaults = {"iso_table": {}} | noise
    camera = small_camera(640, 640, black_level_dn=200.0, bit_depth=14, stages=NOISY, **defaults)
    large = binned(simulate(flat(camera)).dn.astype(float), SIDE, 1) / SIDE**2
    small = simulate(flat(camera, SIDE, frame=1)).dn / 4.0  # codes of 16 bits
    accept({"mean": stats.ttest_ind(large.ravel(), small.ravel()).pvalue, "variance": equal_variance_p(large, small)})


def equal_variance_p(first, second):
    """p-value of equal variances, by Brown and Forsythe's test, which holds for tails unlike the normal's."""
    return stats.levene(first.ravel(), second.ravel(), center="median").pvalue


def test_what_rows_and_columns_share_is_averaged_over_as_many():
    stages = {"row_noise": RowNoise(9.0), "column_offset": ColumnOffset(12.0)}
    camera = small_camera(1200, 1200, black_level_dn=200.0, bit_depth=14, stages=stages)
    frames = binned(simulate(flat(camera)).dn.astype(float), SIDE, 1) / SIDE**2, simulate(flat(camera, SIDE, frame=1)).dn / 4.0
    checks = {axis: equal_variance_p(*(frame.mean(axis=axis) for frame in frames)) for axis in (0, 1)}
    accept(checks)
    expected = [9.0 / 2.0, 12.0 / 2.0]
    found = [combine_photosites(camera, SIDE).stages[stem].sigma_dn / 4.0 for stem in stages]
    assert found == pytest.approx(expected)


def test_what_a_stage_becomes():
    assert FullWell(1000.0).combined(3, 1.0) == FullWell(9000.0)
    hot = HotPixels(1e-4, 50.0).combined(3, 1.0)
    assert hot.share == pytest.approx(9e-4) and hot.rate_e_per_s == pytest.approx(50.0)
    crowded = HotPixels(0.5, 50.0).combined(3, 1.0)
    assert crowded.share == 1.0 and crowded.share * crowded.rate_e_per_s == pytest.approx(9 * 0.5 * 50.0)
    rows = np.arange(4000)
    mean = np.sin(2 * np.pi * (rows + 0.25) / 10.0).reshape(-1, 4).mean(axis=1)
    ripple = Banding(3.0, 10.0).combined(4, 1.0)
    assert ripple.period_px == 2.5 and ripple.amplitude_dn == pytest.approx(3.0 * np.sqrt(2.0) * mean.std(), rel=1e-3)
    assert Banding(3.0, 6.0).combined(4, 1.0) is None


def test_a_side_of_one_is_the_camera_itself_and_one_too_large_is_refused():
    camera = small_camera(64, 48)
    assert combine_photosites(camera, 1) is camera
    with pytest.raises(PhotositeError, match="leaves 2 x 1 of the sensor's photosites"):
        combine_photosites(camera, 32)


def test_a_window_keeps_its_place_and_colours():
    camera = small_camera(640, 480, cfa="GRBG", window=Window(102, 66, 200, 120))
    body = combine_photosites(camera, 4)
    assert (body.window.x, body.window.y) == (24, 16) and (body.window.width, body.window.height) == (50, 30)
    assert body.frame_cfa() == "GRBG"


@pytest.mark.parametrize("window", [None, Window(64, 32, 576, 448), Window(0, 0, 640, 480)])
def test_of_a_sensor_with_optical_black_the_lit_part_is_read_where_it_lies(window):
    """The optical axis meets the middle of the whole sensor, so that covered photosites keep their places."""
    camera = small_camera(640, 480, cfa="RGGB", window=window, optical_black=OpticalBlack(left_px=64, top_px=32))
    body = combine_photosites(camera, 4)
    assert body.window == Window(16, 8, 144, 112) and (body.width_px, body.height_px) == (160, 120)
    assert body.optical_black is None and body.frame_cfa() == "RGGB"
    part = combine_photosites(replace(camera, window=Window(320, 240, 128, 64)), 4)
    assert part.window == Window(80, 60, 32, 16)


def test_a_window_of_covered_photosites_alone_is_refused():
    camera = small_camera(640, 480, window=Window(0, 0, 48, 480), optical_black=OpticalBlack(left_px=64))
    with pytest.raises(
        PhotositeError, match=r"camera.window = 48 x 480 at \(0, 0\): no light reaches it; .* 576 x 480 at \(64, 0\)"
    ):
        combine_photosites(camera, 4)
