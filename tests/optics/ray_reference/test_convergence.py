"""Rays are added until photosites agree with themselves, each for itself."""

import numpy as np
from helpers.randomness import accept
from scipy import stats

from simulator.optics.ray_reference.convergence import REPLICATIONS, RaySet, follow_until_converged


class NoisyLight:
    """Light of 1 with normal noise of a standard deviation per ray; it counts the rays that each photosite is asked for."""

    def __init__(self, deviation: np.ndarray) -> None:
        self.deviation, self.rays, self.seeds = deviation, np.zeros(len(deviation), int), []

    def sample(self, rays: RaySet, places: np.ndarray) -> np.ndarray:
        self.rays[places] += rays.rays
        self.seeds.append(rays.seed)
        noise = np.random.default_rng(rays.seed).standard_normal(len(self.deviation))[places]
        return 1.0 + self.deviation[places] * noise / np.sqrt(rays.rays)


def test_photosites_get_as_many_rays_as_their_noise_asks_for():
    deviation = np.repeat([0.0, 0.2, 0.8, 3.2], 500)
    light = NoisyLight(deviation)
    found = follow_until_converged(light.sample, len(deviation), lambda _: 0.01 + np.zeros_like(_), 16, 1 << 16)
    assert found.good.all() and found.error.max() <= 0.01
    rays = light.rays.reshape(4, 500) / REPLICATIONS
    assert (rays[0] == 16).all() and rays[1].mean() < rays[2].mean() / 4 < rays[3].mean() / 16
    assert len(set(light.seeds)) == len(light.seeds), "every set of rays is scrambled anew"


def test_the_estimated_error_is_that_of_the_mean():
    """Without a bound to stop at, (light - 1) / error has Student's t distribution."""
    light = NoisyLight(np.ones(4000))
    found = follow_until_converged(light.sample, 4000, lambda _: np.zeros_like(_), 64, 256)
    assert not found.good.any() and (light.rays == 256 * REPLICATIONS).all()
    accept({"t": float(stats.kstest((found.light - 1.0) / found.error, stats.t(REPLICATIONS - 1).cdf).pvalue)})


def test_a_photosite_does_not_depend_on_others():
    deviation = np.linspace(0.0, 2.0, 60)
    whole = follow_until_converged(NoisyLight(deviation).sample, 60, lambda _: 0.02 + np.zeros_like(_), 16, 4096)
    calm = deviation.copy()
    calm[30:] = 0.0
    part = follow_until_converged(NoisyLight(calm).sample, 60, lambda _: 0.02 + np.zeros_like(_), 16, 4096)
    assert np.array_equal(part.light[:30], whole.light[:30])
