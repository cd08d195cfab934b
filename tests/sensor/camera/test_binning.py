"""Binning puts photosites of one colour together, before or after they are read."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.neighbors import binned
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.banding import Banding
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.row_noise import RowNoise

LENS = ThinLens(50.0, 8.0, cos4=False)
NOISY = {"photon_shot_noise": PhotonShotNoise()}


def shot(picture, binning, time_s=0.005, **settings):
    camera = small_camera(*np.shape(picture)[1::-1], binning=binning, **settings)
    return Shot(band_scene(picture, math.inf), LENS, Exposure(time_s), camera, Seeds(frame=4))


@pytest.mark.parametrize("cfa", ["MONO", "GRBG"])
@pytest.mark.parametrize("factor", [2, 3])
def test_charge_and_codes_of_one_colour_are_put_together(cfa, factor):
    picture = np.random.default_rng(1).uniform(0.1, 1.0, (50, 62, 3 if cfa != "MONO" else 1))
    step = 1 if cfa == "MONO" else 2
    plain = simulate(shot(picture, None, cfa=cfa))
    sums = binned(plain.mean_electrons.astype(float), factor, step)
    charge, average = (simulate(shot(picture, Binning(factor, mode), cfa=cfa)) for mode in ("charge", "average"))
    assert charge.dn.shape == average.dn.shape == sums.shape and charge.cfa == cfa
    assert np.abs(charge.mean_electrons / sums - 1).max() < 1e-6 and np.abs(charge.dn - sums).max() < 0.51
    assert np.array_equal(average.dn, np.rint(binned(plain.dn.astype(float), factor, step) / factor**2))
    assert np.abs(average.mean_electrons / (sums / factor**2) - 1).max() < 1e-6


def test_read_noise_counts_once_for_charge_and_is_averaged_for_codes():
    checks = {}
    for mode in ("charge", "average"):
        camera = {"iso_table": {100: IsoSetting(1.0, 20.0)}, "black_level_dn": 500.0, "stages": NOISY}
        taken = shot(np.full((600, 600), 0.5), Binning(2, mode), **camera)
        raw, moments = simulate(taken), None
        mean_e = float(raw.mean_electrons.mean()) / (4 if mode == "charge" else 1)  # of one photosite before binning
        moments = plan(taken).sensor.moments(mean_e)
        expected = 4 * mean_e + 400 + 1 / 12 if mode == "charge" else (mean_e + 400 + 1 / 12) / 4 + 1 / 12
        assert moments.variance == pytest.approx(expected)
        checks[mode, "mean"] = mean_p(raw.dn, moments.mean, moments.variance)
        checks[mode, "variance"] = variance_p(raw.dn, moments.variance)
    accept(checks)


@pytest.mark.parametrize("cfa", ["MONO", "GRBG"])
@pytest.mark.parametrize("mode", ["charge", "average"])
def test_noise_that_binned_photosites_share_falls_less(cfa, mode):
    """Rows share an offset, and neighbours charge: variance of frames whose pixels lie too far apart to share either."""
    stages = {**NOISY, "row_noise": RowNoise(12.0)}
    camera = {"iso_table": {100: IsoSetting(1.0, 3.0)}, "black_level_dn": 500.0, "stages": stages, "cfa": cfa}
    checks = {}
    for name, changes in {"rows": {}, "crosstalk": {"crosstalk": Crosstalk(electrical=0.06, electrical_corner=0.02)}}.items():
        taken = shot(np.full((480, 120), 0.3), Binning(2, mode), **camera, **changes)
        frames = [simulate(replace(taken, seeds=Seeds(frame=frame))) for frame in range(20)]
        places = slice(4, -4, 4), slice(24, 25)  # of one colour
        mean_e = float(frames[0].mean_electrons[places].mean()) / (
            4 if mode == "charge" else 1
        )  # of one photosite before binning
        moments, codes = plan(taken).sensor.moments(mean_e), np.stack([raw.dn[places] for raw in frames])
        checks |= {
            (name, "mean"): mean_p(codes, moments.mean, moments.variance),
            (name, "variance"): variance_p(codes, moments.variance),
        }
    accept(checks)


@pytest.mark.parametrize("period", [2.0, 7.0, 300.0])
def test_banding_falls_by_the_mean_of_its_sine_over_the_rows_of_a_block(period):
    taken = shot(np.full((24, 24), 0.3), Binning(3, "average"), cfa="GRBG", stages={"banding": Banding(9.0, period)})
    phases = np.arange(720) / 720
    rows = [9.0 * np.sin(2 * np.pi * (row / period + phases)) for row in (0, 2, 4)]
    assert plan(taken).sensor.moments(50.0).variance == pytest.approx(np.mean(rows, axis=0).var() + 1 / 108 + 1 / 12, rel=1e-9)


def test_a_crop_is_the_part_of_the_whole():
    picture = np.random.default_rng(2).uniform(0.1, 1.0, (64, 80, 3))
    settings = {"cfa": "RGGB", "stages": NOISY, "crosstalk": Crosstalk(0.02, 0.0, 0.02)}
    for mode in ("charge", "average"):
        whole = simulate(shot(picture, Binning(2, mode), **settings)).dn
        part = simulate(shot(picture, Binning(2, mode), window=Window(20, 12, 40, 36), **settings)).dn
        assert np.array_equal(part, whole[6:24, 10:30])


def test_a_window_that_cuts_a_block_is_refused():
    with pytest.raises(PhotositeError, match="camera.window.x = 2: give a multiple of 4"):
        plan(shot(np.ones((64, 80, 3)), Binning(2), cfa="RGGB", window=Window(2, 0, 40, 40)))


@pytest.mark.parametrize(("arguments", "message"), [((5,), "factor = 5"), ((2, "sum"), "mode = sum")])
def test_other_factors_and_modes_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=f"camera.binning.{message}"):
        Binning(*arguments)
