"""The truth twin says what the noisy frame is on average."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.registry import STAGES

LENS = ThinLens(50.0, 8.0, cos4=False)


def noisy_camera(**stages):
    return small_camera(
        400,
        300,
        bit_depth=14,
        black_level_dn=512.0,
        iso_table={100: IsoSetting(0.8, 4.0)},
        read_noise_after_gain_dn=2.0,
        stages={stem: STAGES[stem](*values) for stem, values in stages.items()},
    )


def test_frames_scatter_about_the_truth_with_the_variance_of_the_model():
    """Mean, variance and the NoiseProfile's S x + O, on an uneven picture, from the residuals of a frame."""
    picture = np.random.default_rng(1).uniform(0.2, 1.0, (30, 40))
    shot = Shot(band_scene(picture, math.inf), LENS, Exposure(0.01), noisy_camera(photon_shot_noise=()), Seeds(frame=5))
    raw, planned = simulate(shot), plan(shot)
    assert 500 < raw.mean_electrons.mean() < 5000
    variance = np.array([planned.sensor.moments(float(e)).variance for e in raw.mean_electrons.ravel()[::997]])
    slope, offset = raw.noise_profile[0]
    x = (raw.noise_free_dn.ravel()[::997] - raw.black_level_dn) / (raw.white_level_dn - raw.black_level_dn)
    assert np.allclose((slope * x + offset) * (raw.white_level_dn - raw.black_level_dn) ** 2, variance, rtol=1e-5)
    sigma = np.sqrt(0.8**2 * raw.mean_electrons.astype(float) + 16.0 + 1 / 12)
    residual = (raw.dn - raw.noise_free_dn.astype(float)) / sigma
    accept({"mean": mean_p(residual, 0.0, 1.0), "variance": variance_p(residual, 1.0, 1 / 1000)})


def test_truth_has_the_dark_current_and_the_clipping_but_not_the_rounding():
    camera = noisy_camera(dark_current=(1000.0,), full_well=(2000.0,))
    for weight in (0.0, 0.01, 1.0):
        raw = simulate(Shot(band_scene(np.full((4, 4), weight), math.inf), LENS, Exposure(0.01), camera))
        expected = 512.0 + 0.8 * np.minimum(raw.mean_electrons.astype(float) + 10.0, 2000.0)
        assert np.allclose(raw.noise_free_dn, expected, rtol=1e-6)


@pytest.mark.parametrize(
    "changes",
    [{}, {"binning": Binning(2, "average")}, {"binning": Binning(2, "charge")}, {"crosstalk": Crosstalk(electrical=0.03)}],
    ids=["plain", "average", "charge", "crosstalk"],
)
def test_the_gain_of_a_frame_is_codes_for_each_mean_electron(changes):
    camera = replace(noisy_camera(photon_shot_noise=()), **changes)
    dark, lit = (
        simulate(Shot(band_scene(np.full((4, 4), weight), math.inf), LENS, Exposure(0.01), camera)) for weight in (0.0, 0.3)
    )
    codes = lit.noise_free_dn.mean(dtype=float) - dark.noise_free_dn.mean(dtype=float)
    assert codes / lit.mean_electrons.mean(dtype=float) == pytest.approx(lit.gain_dn_per_e, rel=1e-5)


def test_white_level_is_the_lower_of_well_and_adc():
    scene = band_scene(np.ones((4, 4)), math.inf)
    for capacity, white in ((2000.0, 512 + 1600), (1e6, 2**14 - 1)):
        raw = simulate(Shot(scene, LENS, Exposure(10.0), noisy_camera(full_well=(capacity,))))
        assert raw.white_level_dn == white
        assert raw.noise_free_dn.max() == pytest.approx(white)


def test_the_same_seed_gives_the_same_frame_and_another_seed_another():
    scene, camera = band_scene(np.ones((4, 4)), math.inf), noisy_camera(photon_shot_noise=())
    frames = [simulate(Shot(scene, LENS, Exposure(0.01), camera, Seeds(frame=seed))).dn for seed in (1, 1, 2)]
    assert np.array_equal(frames[0], frames[1]) and not np.array_equal(frames[0], frames[2])
