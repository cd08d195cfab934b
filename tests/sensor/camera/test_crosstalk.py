"""Crosstalk passes shares to neighbours, loses nothing, and correlates what had been counted but not what is counted later."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.neighbors import crosstalk_stencil
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from helpers.scene_builders import band_scene
from scipy.ndimage import correlate

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.stage import Moments

LENS = ThinLens(50.0, 8.0, cos4=False)
NOISY = {"photon_shot_noise": PhotonShotNoise()}


def take(picture, crosstalk, seed=0, **settings):
    camera = small_camera(*np.shape(picture)[::-1], crosstalk=crosstalk, **settings)
    return simulate(Shot(band_scene(picture, math.inf), LENS, Exposure(0.02), camera, Seeds(frame=seed)))


@pytest.mark.parametrize("kind", ["optical", "electrical"])
def test_the_mean_is_mixed_with_the_shares_given_and_edges_stand_in_for_what_lies_beyond(kind):
    picture = np.random.default_rng(1).uniform(0.1, 1.0, (48, 64))
    plain = take(picture, None)
    mixed = take(picture, Crosstalk(**{kind: 0.03, f"{kind}_corner": 0.01}))
    expected = correlate(plain.mean_electrons.astype(float), crosstalk_stencil(0.03, 0.01), mode="nearest")
    assert np.abs(mixed.mean_electrons / expected - 1.0).max() < 1e-6
    assert np.abs(mixed.noise_free_dn - expected).max() < 0.01
    assert np.abs(mixed.dn - expected).max() <= 0.501


def test_a_flat_field_stays_flat_and_nothing_is_lost():
    spot = np.full((48, 64), 0.2)
    spot[20, 30] = 1.0
    flat, mixed = (take(spot, shares).mean_electrons.astype(float) for shares in (None, Crosstalk(0.05, 0.02, 0.04)))
    assert mixed.sum() == pytest.approx(flat.sum(), rel=1e-6)
    assert np.ptp(take(np.full((48, 64), 0.3), Crosstalk(0.05, 0.02, 0.04)).dn) <= 1


def test_optical_crosstalk_leaves_counts_independent_and_electrical_correlates_them():
    picture = np.full((400, 400), 1.0)
    checks = {}
    optical = take(picture, Crosstalk(optical=0.05), stages=NOISY)
    mean = float(optical.mean_electrons.mean())
    checks["optical variance"] = variance_p(optical.dn, mean + 1 / 12)
    checks["optical neighbours"] = correlation_p(optical.dn[:, 1:], optical.dn[:, :-1])
    shares = Crosstalk(electrical=0.05, electrical_corner=0.01)
    electrical = take(picture, shares, seed=3, stages=NOISY).dn.astype(float)
    kernel = crosstalk_stencil(0.05, 0.01)
    variance = mean * (kernel**2).sum() + 1 / 12
    # correlated samples hold less information: sum of squared autocorrelations of the stencil
    spread = correlate(np.pad(kernel, 2), np.pad(kernel, 2), mode="constant")
    fewer = (spread**2).sum() / spread.max() ** 2
    checks["electrical variance"] = mean_p((electrical - electrical.mean()) ** 2, variance, 2 * variance**2 * fewer)
    neighbours = mean * (kernel[:, 1:] * kernel[:, :-1]).sum()
    product = (electrical[:, 1:] - electrical.mean()) * (electrical[:, :-1] - electrical.mean())
    checks["electrical covariance"] = mean_p(product, neighbours, variance**2 * 1.5 * fewer)
    accept(checks)
    assert shares.of_charge(Moments(mean, mean)).variance == pytest.approx(mean * (kernel**2).sum())


def test_a_crop_is_the_part_of_the_whole():
    picture = np.random.default_rng(2).uniform(0.1, 1.0, (60, 80))
    shares = Crosstalk(0.03, 0.01, 0.02, 0.005)
    whole = take(picture, shares, stages=NOISY, cfa="RGGB")
    for x, y, width, height in ((0, 0, 31, 25), (17, 11, 40, 30), (49, 35, 31, 25)):
        part = take(picture, shares, stages=NOISY, cfa="RGGB", window=Window(x, y, width, height))
        here = np.s_[y : y + height, x : x + width]
        assert np.array_equal(part.dn, whole.dn[here]) and np.array_equal(part.noise_free_dn, whole.noise_free_dn[here])
        assert part.cfa == ("RGGB" if x % 2 == y % 2 == 0 else "BGGR")


def test_the_passes_are_absent_when_nothing_is_shared():
    picture = np.full((48, 64), 0.5)
    assert np.array_equal(take(picture, Crosstalk(), stages=NOISY).dn, take(picture, None, stages=NOISY).dn)
    camera = small_camera(crosstalk=Crosstalk(optical=0.01))
    steps = {step.stage: step.kept for step in plan(Shot(band_scene(picture), LENS, Exposure(0.01), camera)).steps}
    assert steps["crosstalk of light"] and not steps["crosstalk of charge"]


@pytest.mark.parametrize(
    ("shares", "message"), [({"optical": -0.1}, "optical = -0.1"), ({"electrical": 0.3}, "electrical = 0.3")]
)
def test_impossible_shares_are_refused(shares, message):
    with pytest.raises(PhotositeError, match=f"camera.crosstalk.{message}"):
        Crosstalk(**shares)


def test_more_than_all_cannot_be_shared():
    with pytest.raises(PhotositeError, match="may not add up to more than 1"):
        Crosstalk(optical=0.2, optical_corner=0.2)
