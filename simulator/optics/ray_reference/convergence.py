"""How many rays a photosite needs: independent replications, doubled until they agree to a stated share of the noise."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

REPLICATIONS = 8  # independently scrambled sets of rays; their scatter estimates the error of their mean
FEWEST_RAYS = 1024  # of a replication
MOST_RAYS = 131072  # of a replication; beyond it a photosite is left as it is, with a warning


@dataclass(frozen=True)
class RaySet:
    """One set of rays: number of the replication, its doubling (0: the first set), and rays."""

    replication: int
    doubling: int
    rays: int

    @property
    def seed(self) -> int:
        """Seed of the scrambling, another one for each set."""
        return 1 + self.replication + REPLICATIONS * self.doubling


@dataclass(frozen=True)
class Converged:
    """Light of photosites with its estimated standard error, (photosites,) float64, and whether the error is allowed."""

    light: np.ndarray
    error: np.ndarray
    good: np.ndarray


def follow_until_converged(
    sample: Callable[[RaySet, np.ndarray], np.ndarray],
    photosites: int,
    allowed: Callable[[np.ndarray], np.ndarray],
    fewest: int = FEWEST_RAYS,
    most: int = MOST_RAYS,
) -> Converged:
    """Follow rays from each photosite until the estimated standard error of its light is allowed.

    A photosite's light is the mean over REPLICATIONS sets of rays that are scrambled independently, its standard error their
    standard deviation / sqrt(REPLICATIONS) (randomised quasi-Monte Carlo, Owen 1998, ACM TOMACS 8, 71). Rays are doubled from
    `fewest`, or `most` where that is less, to `most` per replication. A photosite is judged by itself alone, so that a crop has
    the bits of the whole frame.
    sample: mean light of some photosites (n,), by a set of rays. allowed: largest standard error for a light.
    """
    total, light, error = np.zeros((REPLICATIONS, photosites)), np.zeros(photosites), np.zeros(photosites)
    active, rays, doubling = np.arange(photosites), 0, 0
    while len(active) and rays < most:
        added = rays or min(fewest, most)
        for replication in range(REPLICATIONS):
            found = sample(RaySet(replication, doubling, added), active).astype(np.float64)
            total[replication, active] = (rays * total[replication, active] + added * found) / (rays + added)
        rays, doubling = rays + added, doubling + 1
        light[active] = total[:, active].mean(axis=0)
        error[active] = total[:, active].std(axis=0, ddof=1) / np.sqrt(REPLICATIONS)
        active = active[error[active] > allowed(light[active])]
    good = np.ones(photosites, bool)
    good[active] = False
    return Converged(light, error, good)
