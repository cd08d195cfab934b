"""Digital gain multiplies codes above black and leaves gaps in the histogram."""

import numpy as np
import pytest
from helpers.randomness import accept, mean_p, variance_p

from simulator.errors import PhotositeError
from simulator.sensor.stages.digital_gain import DigitalGain
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.stage import Moments


def test_codes_are_multiplied_above_black_rounded_and_clipped(bench):
    light = np.array([[0.0, 1.0, 2.0, 3.0, 100.0, 60000.0]])
    codes = bench.sensor(light, DigitalGain(1.5, 64.0), black=64.0)
    assert codes.tolist() == [[64, 66, 67, 68, 214, 65535]]  # ties to even: 65.5 and 68.5


def test_black_level_stays(bench):
    assert (bench.sensor(np.zeros((4, 4)), DigitalGain(8.0, 512.0), black=512.0) == 512).all()


def test_a_whole_factor_leaves_gaps(bench):
    codes = bench.sensor(np.full((200, 200), 50.0), PhotonShotNoise(), DigitalGain(4.0, 64.0), black=64.0)
    assert ((codes - 64) % 4 == 0).all() and len(np.unique(codes)) > 20


@pytest.mark.parametrize("factor", [2.0, 1.37])
def test_frames_have_the_moments_the_stage_says(bench, factor):
    codes = bench.sensor(np.full((500, 500), 3000.0), PhotonShotNoise(), DigitalGain(factor, 64.0), black=64.0)
    expected = DigitalGain(factor, 64.0).moments(Moments(3064.0, 3000.0))
    accept({"mean": mean_p(codes, expected.mean, expected.variance), "variance": variance_p(codes, expected.variance)})


@pytest.mark.parametrize(("noise_dn", "off"), [(5.0, 0.10), (3.0, 0.20)])
@pytest.mark.parametrize("factor", [0.35, 0.5, 0.7, 0.95, 1.05, 1.5])
def test_the_stated_variance_is_as_far_off_as_the_page_says(bench, factor, noise_dn, off):
    """Means between two codes, and all over the period of a factor's errors; 250,000 codes each tell a variance to 0.3 %."""
    means = np.linspace(1000.0, 1020.0, 11)
    codes = bench.sensor(
        np.repeat(means[:, None], 250_000, axis=1),
        ReadNoiseAfterGain(noise_dn),
        DigitalGain(factor, 64.0),
        black=64.0,
    )
    stated = DigitalGain(factor, 64.0).moments(Moments(1000.0, noise_dn**2 + 1 / 12)).variance
    assert np.abs(stated / codes.astype(float).var(axis=1) - 1.0).max() <= off + 0.01


def test_a_factor_of_0_is_refused():
    with pytest.raises(PhotositeError, match="digital_gain.factor"):
        DigitalGain(0.0)
