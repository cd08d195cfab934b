"""The variance of codes whose charges electrical crosstalk mixes: each neighbour's own noise, by the square of its share."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.hdr_bench import DUAL_GAIN, TWO_EXPOSURES, TWO_PHOTODIODES, combined_codes, hdr_plan
from helpers.neighbors import binned_variance, crosstalk_stencil, stencil_sum
from helpers.randomness import accept, mean_p
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.remosaic import Remosaic
from simulator.sensor.hdr_variance import mixed_combined_variance
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

LENS = ThinLens(50.0, 8.0, cos4=False)
SHARES, STENCIL = Crosstalk(electrical=0.05, electrical_corner=0.02), crosstalk_stencil(0.05, 0.02)
NOISY = {"photon_shot_noise": PhotonShotNoise()}
EDGES = np.kron(np.random.default_rng(3).choice([0.001, 0.03, 1.0], (9, 12)), np.ones((4, 4)))  # flat parts of any contrast


def shot_of(picture=EDGES, crosstalk=SHARES, time_s=0.01, cfa="MONO", seed=0, **changes):
    settings = dict(bit_depth=14, black_level_dn=256.0, iso_table={100: IsoSetting(0.8, 4.0)}, read_noise_after_gain_dn=2.0)
    camera = small_camera(*np.shape(picture)[1::-1], cfa, crosstalk=crosstalk, **{"stages": NOISY, **settings, **changes})
    return Shot(band_scene(picture, math.inf), LENS, Exposure(time_s), camera, Seeds(frame=seed), truth=("variance",))


def scatter(shot, frames):
    """The truth's variance, and that of the codes of many frames."""
    cache = LightCache()
    raws = [simulate(replace(shot, seeds=Seeds(frame=seed)), cache=cache) for seed in range(frames)]
    return raws[0].truth["variance"].astype(float), np.stack([raw.dn for raw in raws]).astype(float).var(axis=0, ddof=1)


def ratio_ps(truth, found, frames):
    """p-values of measured over stated variances in classes of the stated one; every third photosite: they share no charge."""
    truth, ratio = truth[::3, ::3].ravel(), found[::3, ::3].ravel() / truth[::3, ::3].ravel()
    return {
        place: mean_p(ratio[part], 1.0, 2.0 / (frames - 1)) for place, part in enumerate(np.array_split(np.argsort(truth), 4))
    }


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_each_neighbour_brings_its_own_shot_noise_by_the_square_of_its_share(cfa):
    """Beside edges and in flat parts of a filter's colours, up to the edge of the sensor."""
    picture = EDGES if cfa == "MONO" else np.stack([EDGES, np.roll(EDGES, 7, 1), np.roll(EDGES, 9, 0)], axis=-1)
    raw, apart = (simulate(shot_of(picture, shares, cfa=cfa)) for shares in (SHARES, None))
    electrons = apart.mean_electrons.astype(float)
    assert electrons.max() > 200.0 * electrons.min() and raw.noise_free_dn.max() < raw.white_level_dn - 1000
    expected = 0.8**2 * binned_variance(electrons, STENCIL, 1, 1) + 4.0**2 + 1 / 12
    np.testing.assert_allclose(raw.truth["variance"], expected, rtol=1e-5)
    np.testing.assert_allclose(raw.mean_electrons, stencil_sum(electrons, STENCIL), rtol=1e-5)


def test_even_light_has_the_variance_that_the_stages_state():
    shot = shot_of(np.full((24, 30), 0.5))
    raw = simulate(shot)
    stated = plan(shot).sensor.moments(float(raw.mean_electrons.mean(dtype=float))).variance
    np.testing.assert_allclose(raw.truth["variance"][1:-1, 1:-1], stated, rtol=1e-5)


@pytest.mark.parametrize(
    "changes",
    [
        {"stages": NOISY | {"full_well": FullWell(3000.0), "dark_current": DarkCurrent(9000.0)}},
        {"bit_depth": 12},
        {"binning": Binning(2, "charge")},
        {"binning": Binning(2, "average")},
        {"cfa": "RRGG/RRGG/GGBB/GGBB", "remosaic": Remosaic(), "crosstalk": Crosstalk(electrical=0.01)},
    ],
    ids=["full wells", "white", "charge of blocks", "codes of blocks", "remosaic"],
)
def test_frames_scatter_as_the_truth_says(changes):
    frames = 120
    shot = shot_of(np.repeat(EDGES[..., None], 3, axis=2) if "cfa" in changes else EDGES, **changes)
    truth, found = scatter(shot, frames)
    assert truth.max() > 5.0 * truth.min()
    accept(ratio_ps(truth, found, frames))


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("mode", ["charge", "average"])
def test_binned_photosites_share_the_noise_of_what_lies_between_them(mode, cfa):
    """A dark colour beside bright ones, and edges that cross blocks."""
    picture = EDGES if cfa == "MONO" else np.stack([EDGES, np.roll(EDGES, 7, 1), np.roll(EDGES, 9, 0)], axis=-1)
    apart = simulate(shot_of(picture, None, cfa=cfa)).mean_electrons.astype(float)
    raw = simulate(shot_of(picture, cfa=cfa, binning=Binning(2, mode)))
    charge = binned_variance(apart, STENCIL, 2, 1 if cfa == "MONO" else 2)
    read = 4.0**2 + 1 / 12
    expected = 0.8**2 * charge + read if mode == "charge" else (0.8**2 * charge / 4 + read) / 4 + 1 / 12
    np.testing.assert_allclose(raw.truth["variance"], expected, rtol=1e-5)


@pytest.mark.parametrize("readout", [DUAL_GAIN, TWO_EXPOSURES, TWO_PHOTODIODES], ids=["gains", "exposures", "photodiodes"])
def test_combined_readings_scatter_as_the_truth_says(device, readout):
    frames, electrons = 120, EDGES * 30000.0
    sensor = hdr_plan(readout, *electrons.shape[::-1], crosstalk=SHARES)
    truth = mixed_combined_variance(device, sensor, [device.upload(electrons.astype(np.float32))] * len(sensor.exposures))
    codes = np.stack([combined_codes(device, sensor, electrons, frame) for frame in range(frames)]).astype(float)
    accept(ratio_ps(truth.astype(float), codes.var(axis=0, ddof=1), frames))


@pytest.mark.parametrize("changes", [{}, {"binning": Binning(2, "charge")}, {"binning": Binning(2, "average")}])
def test_a_window_has_the_bits_of_the_whole_frame(changes):
    whole, part = (simulate(shot_of(window=window, **changes)) for window in (None, Window(12, 8, 20, 16)))
    here = np.s_[8:24, 12:32] if not changes else np.s_[4:12, 6:16]
    np.testing.assert_array_equal(part.truth["variance"], whole.truth["variance"][here])
