"""Dark current is Poisson with mean rate times time, independent of the light's shot noise."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, counts_p, mean_p, variance_p

from simulator.errors import PhotositeError
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((512, 512))


@pytest.mark.parametrize(("rate", "time"), [(0.3, 1.0), (0.02, 30.0), (5.0, 60.0), (10.0, 3600.0)])
def test_dark_electrons_are_poisson(bench, rate, time):
    counts, mean = bench.sensor(DARK, DarkCurrent(rate, time)), rate * time
    accept(
        {
            "mean": mean_p(counts, mean, mean),
            "variance": variance_p(counts, mean, excess_kurtosis=1 / mean),
            "shape": counts_p(counts, mean),
        }
    )


def test_adds_to_the_photoelectrons_and_leaves_their_pattern(bench):
    light = bench.sensor(DARK + 40.0, PhotonShotNoise()).astype(int)
    both = bench.sensor(DARK + 40.0, PhotonShotNoise(), DarkCurrent(2.0, 10.0)).astype(int)
    dark = bench.sensor(DARK, DarkCurrent(2.0, 10.0)).astype(int)
    assert np.array_equal(both, light + dark)
    accept({"independent": correlation_p(light, dark)})


def test_no_rate_gives_no_electrons(bench):
    assert not bench.sensor(DARK, DarkCurrent(0.0, 100.0)).any()


def test_a_negative_rate_is_refused():
    with pytest.raises(PhotositeError, match="dark_current.rate"):
        DarkCurrent(-1.0)


def test_moments_add_rate_times_time_to_both():
    assert DarkCurrent(2.0, 3.0).moments(Moments(1.0, 1.0)) == Moments(7.0, 7.0)


def test_it_follows_the_band_gap_of_silicon_with_temperature():
    """Janesick 2001: dark current of silicon doubles about every 8 K near room temperature; Eg(300 K) = 1.1108 eV (R23)."""
    warm, cold = (DarkCurrent(10.0, 1.0, temperature_k=kelvins).mean_e for kelvins in (308.15, 288.15))

    def gap(t):
        return 1.1557 - 7.021e-4 * t**2 / (1108 + t)

    assert gap(300.0) == pytest.approx(1.1108, abs=5e-5)
    exponent = gap(288.15) / (2 * 8.617333e-5 * 288.15) - gap(308.15) / (2 * 8.617333e-5 * 308.15)
    assert warm / cold == pytest.approx((308.15 / 288.15) ** 1.5 * np.exp(exponent), rel=1e-6)
    assert 7.0 < 20.0 / np.log2(warm / cold) < 10.0
    assert DarkCurrent(10.0, 2.0).mean_e == 20.0


def test_impossible_temperatures_are_refused():
    with pytest.raises(PhotositeError, match="dark_current.temperature = 25 K"):
        DarkCurrent(1.0, temperature_k=25.0)
