"""How exact the lens blur has to be, and which of its settings are just exact enough.

An error cannot be seen while it is well below the noise of the raw. The share of the brightest light that the blur may be wrong
by is tolerance * sigma / electrons, with sigma^2 = electrons + read noise^2 (EMVA 1288). The laws below say what a method
leaves of light that varies by its whole range. They bound what was measured in float64 and on the closed forms of
tests/helpers/lens_truths.py; docs/lens_accuracy.md has the figures.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.scene.scene import Scene

MEASURED = 0.1 * math.sqrt(2004.0) / 2000.0  # allowed error at which the settings below were found: 0.1 sigma of 2000 e-
SHARP_PX = 0.3  # radius of a blur circle that may be left out
SAME_PX = 0.02  # radii that lie closer share one blur circle
SLOPE_STEP = 0.03  # slopes are rounded to multiples of this
RAYS = 16384  # per photosite: p99.9 of |z| below 0.1 at 2000 e- on the closed forms, small lights left out
FINE_PX = 12.0  # blur circles up to this radius do not wipe out what lies between photosites
FEWEST, MOST = 128, 1024  # points of the aperture at MEASURED, by radius
BRIGHT = 0.999  # quantile of the scene's light that counts as its brightest: a few lights more leave the rest its accuracy
_SAMPLES = 400  # places per axis at which the scene's light is looked at


@dataclass(frozen=True)
class Accuracy:
    """Error that the blur may have.

    tolerance: in standard deviations of a frame's noise at the brightest light; 0: rays, the reference path.
    electrons: of the brightest light [e-]. read_noise_e: of a photosite [e-].
    peak: light of the brightest lamp, in units of the brightest light. rays: per photosite where the tolerance is 0.
    """

    tolerance: float = 0.1
    electrons: float = 2000.0
    read_noise_e: float = 2.0
    peak: float = 1.0
    rays: int = RAYS

    @property
    def sigma(self) -> float:
        """One standard deviation, as a share of the brightest light."""
        return math.sqrt(self.electrons + self.read_noise_e**2) / self.electrons

    @property
    def allowed(self) -> float:
        """Error that is allowed, as a share of the brightest light."""
        return self.tolerance * self.sigma

    @property
    def looser(self) -> float:
        """Allowed error in units of MEASURED."""
        return max(self.allowed / MEASURED, 1e-6)

    @property
    def sharp_px(self) -> float:
        """Radius of a blur circle that may be left out: what a mean over it takes from a wave grows with its square."""
        return min(SHARP_PX * math.sqrt(self.looser), 0.4)

    @property
    def same_px(self) -> float:
        """Radii that lie closer share one blur circle: the error is proportional to their difference."""
        return SAME_PX * min(self.looser, 2.0)

    @property
    def slope_step(self) -> float:
        """Slopes are rounded to multiples of this: the error is proportional to it."""
        return max(SLOPE_STEP * min(self.looser, 2.0), 0.002)

    @property
    def points_factor(self) -> float:
        """How many times the points of MEASURED an aperture gets; their error falls as their number to the power of -0.8."""
        return self.looser**-1.25

    @property
    def coarser(self) -> float:
        """How many times wider than in MEASURED the slabs of radius are; narrower ones have not been measured."""
        return min(max(0.5 * self.looser, 1.0), 4.0)

    def over(self, least_px: np.ndarray, largest_px: np.ndarray, scale: float) -> np.ndarray:
        """Points per photosite and axis, 1, 2 or 4, for blur circles between these radii [photosites]; at most the scene's.

        scale: scene pixels per photosite.
        """
        good = [grid_error(least_px, over, scale) <= self.allowed for over in (1, 2)]
        good[0] &= lamp_error(self.peak, least_px, scale) <= self.allowed
        needed = np.where(good[0], 1, np.where(good[1], 2, 4))
        there = 4 if scale >= 3.0 else 2 if scale >= 1.5 else 1
        return np.where(largest_px * min(self.looser, 1.0) <= FINE_PX, np.minimum(needed, there), 1)

    def in_sigma(self, share: float) -> float:
        """An error that is a share of the brightest light, in standard deviations."""
        return share / self.sigma


def grid_error(radius_px, over: int, scale: float):
    """What points on a grid of `over` per photosite and axis leave: waves of 9 photosites and edges, radius 0.7 to 15.5.

    More where the scene, of `scale` pixels per photosite, is finer than the points: they are means then, not values.
    """
    return (0.025 if over >= scale else 0.04) / (over**2 * (np.abs(radius_px) + 1.0))


def lamp_error(peak: float, radius_px, scale: float):
    """What one point per photosite leaves at the edge of a lamp's spot, when the lamp is a scene pixel somewhere in it."""
    return 0.5 * (peak - 1.0) / (max(scale, 1.0) ** 2 * math.pi * np.maximum(radius_px, 0.5) ** 2)


def copy_error(radius_px: float) -> float:
    """What leaving out a blur circle takes from a wave of 9 photosites with half of the light as amplitude.

    1 - 2 J1(a)/a = a^2 / 8 of it, with a = 2 pi radius / period.
    """
    return 0.5 * (2.0 * math.pi * radius_px / 9.0) ** 2 / 8.0


def slope_error(step: float) -> float:
    """What slopes rounded to multiples of `step` leave of waves of 14 and 16 photosites: 0.05 for each unit of slope."""
    return 0.05 * step / math.sqrt(2.0)


def product_error(radius_px):
    """What the product of two layers' means leaves of the mean of their product over a photosite's area.

    A penumbra's slope, 2 / (pi R), times that of a wave of 24 photosites and a fifth of the light, over 12.
    """
    return 0.0027 / np.maximum(np.abs(radius_px), 0.5)


def points_error(points: int, over: int) -> float:
    """What a covariance over the aperture from so many points leaves, an edge before stripes of contrast 0.58."""
    return 0.4 / points if over == 1 else 0.32 * points**-0.8


def brightest_electrons(scene: Scene, weights: np.ndarray, per_radiance: float) -> tuple[float, float]:
    """Electrons of the brightest light, the greatest BRIGHT quantile of all layers and channels, and of the brightest lamp.

    weights: (bands, channels) of scene planes in electron radiance. per_radiance: electrons per electron radiance.
    """
    brightest = peak = 0.0
    for layer in scene.layers:
        step_y, step_x = (-(-size // _SAMPLES) for size in layer.planes.shape[:2])
        light = layer.planes[::step_y, ::step_x].reshape(-1, layer.planes.shape[2]) @ weights
        brightest = max(brightest, float(np.quantile(light, BRIGHT, axis=0).max()))
        peak = max(peak, float((layer.planes.max(axis=(0, 1)) @ weights).max()))
    return float(brightest * per_radiance), float(peak * per_radiance)
