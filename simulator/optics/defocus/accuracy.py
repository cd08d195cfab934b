"""Accuracy that the lens blur needs, and the cheapest settings that reach it.

An error well below the noise of the raw is invisible. The allowed error, as a share of the brightest light, is
tolerance * sigma / electrons, with sigma^2 = electrons + read noise^2 (EMVA 1288). The laws below give the error of each method
for light that varies between zero and its maximum. They bound what was measured in float64 and on the closed forms of
tests/helpers/lens_truths.py; docs/lens_accuracy.md has the figures.
"""

import math
from dataclasses import dataclass
from typing import overload

import numpy as np

WAVE_CURVATURE = 0.234  # second difference between photosites of a wave of 9 photosites that varies by the whole light
MEASURED = 0.1 * math.sqrt(2004.0) / 2000.0  # allowed error at which the settings below were found: 0.1 sigma of 2000 e-
SHARP_PX = 0.3  # largest blur radius that may be ignored at MEASURED [photosites]
MOST_SHARP_PX = 0.4  # the same, whatever is allowed
SAME_PX = 0.02  # largest difference of radii that share one blur circle [photosites]
SLOPE_STEP = 0.03  # step to which slopes of the radius are rounded [photosites per photosite]
RAYS = 131072  # most rays of a photosite in each of the reference's replications
RAY_SAMPLES = 8  # most per photosite and axis that rays meet, of a scene whose pixels are not photosites
RAY_ERROR = 0.015  # largest standard error of the reference [standard deviations of the photosite's noise]: 0.05 is 3.3 of them
FINE_PX = 12.0  # blur circles up to this radius keep detail finer than a photosite
FEWEST, MOST = 128, 1024  # aperture samples at MEASURED for the smallest and the largest radius
MOST_WIDE = 4096  # the same for the largest radius on photosites that are wider than the camera's
WIDE_PX = 24.0  # smallest blur radius at MEASURED for which light is computed on photosites twice as wide [photosites]
AGREED = 0.58  # difference of a block's means over half and all of its points at which they suffice [allowed errors]
MOST_COVARIANCE = 0.25  # of two numbers from 0 to 1 (Popoviciu's and Cauchy and Schwarz' inequalities)
SQUARES_CROSSED = 0.28  # radius in samples at which circles bring 1 - 1/e of the most covariance into even squares
ALIKE_PX = 0.8  # difference of signed radii up to which layers hide the same parts at each point of the aperture [photosites]
LAMP_PEAK = 4.0  # radiance of the brightest pixel, in units of the brightest light, from which on it is a lamp
SAMPLES_PER_AXIS = (1, 2, 4)  # samples per photosite and axis that kernels know


@dataclass(frozen=True)
class Accuracy:
    """Error that the lens blur may have.

    tolerance: allowed error in standard deviations of a frame's noise at the brightest light; 0: rays, the reference path.
    electrons: of the brightest light [e-]. read_noise_e: of a photosite [e-].
    peak: radiance of the brightest scene pixel, in units of the brightest light.
    rays: most of a photosite and replication where the tolerance is 0 (`follow_until_converged`). ray_error: standard error
        [standard deviations of the noise] at which they suffice. electrons_per_radiance: of a photosite [e- per unit of the
        mosaic, e- s^-1 um^-2 sr^-1].
    ray_samples: most samples per photosite and axis that rays meet.
    detail: difference between neighbouring pixels of a scene finer than the photosites, of `scene_detail`; 0: a coarser scene.
    pixel_detail: the same of a scene of one pixel per photosite. crossed_detail: the same of a wall whose small circles cross
        borders of photosites, since it moves, lies beside them, or is spread by a lens; 0: it is distorted, or no wall.
    whole_pixels: least samples per photosite and axis that divide each pixel of a fine scene into whole samples; 0: none do.
    brightest: radiance of the brightest light [unit of the mosaic]; 0: unknown.
    lamp_sharp_px: largest blur radius that may be ignored around lamps of a fine scene (`lamp_sharp_px`) [photosites].
    """

    tolerance: float = 0.1
    electrons: float = 2000.0
    read_noise_e: float = 2.0
    peak: float = 1.0
    rays: int = RAYS
    ray_error: float = RAY_ERROR
    ray_samples: int = RAY_SAMPLES
    electrons_per_radiance: float = 1.0
    detail: float = 0.0
    pixel_detail: float = 0.0
    crossed_detail: float = 0.0
    whole_pixels: int = 0
    brightest: float = 0.0
    lamp_sharp_px: float = math.inf

    @property
    def sigma(self) -> float:
        """One standard deviation, as a share of the brightest light."""
        return math.sqrt(self.electrons + self.read_noise_e**2) / self.electrons

    @property
    def allowed(self) -> float:
        """Error that is allowed, as a share of the brightest light."""
        return self.tolerance * self.sigma

    @property
    def has_lamps(self) -> bool:
        """Whether the brightest scene pixel is a lamp."""
        return self.peak >= LAMP_PEAK

    @property
    def lamp_contrast(self) -> float:
        """Contrast of a lamp's edge in the dark, as a share of the brightest light, as `scene_detail` counts it; 0: no lamp.

        A lamp is too small for the quantile of the brightest light, and much brighter.
        """
        return self._lamp_contrast(0.1)

    @property
    def dark_lamp_contrast(self) -> float:
        """The same in the noise of photosites that see nothing of it, where its path begins or ends."""
        return self._lamp_contrast(0.0)

    def _lamp_contrast(self, lit: float) -> float:
        """Contrast of a lamp where photosites see this share of it."""
        if not self.has_lamps:
            return 0.0
        noise = self.read_noise_e**2 + lit * self.peak * self.electrons
        return self.peak * math.sqrt((self.electrons + self.read_noise_e**2) / max(noise, 1.0))

    @property
    def looser(self) -> float:
        """Allowed error in units of MEASURED."""
        return max(self.allowed / MEASURED, 1e-6)

    @property
    def sharp_px(self) -> float:
        """Largest blur radius that may be ignored [photosites].

        The loss of contrast of a sinusoid grows with the square of the radius, the light that crosses the borders of
        photosites with the radius. Lamps are too small for `detail`.
        """
        smooth_px = min(SHARP_PX * math.sqrt(self.looser), MOST_SHARP_PX, self.lamp_sharp_px)
        detail = max(self.detail, self.crossed_detail)
        return min(smooth_px, self.allowed / crossing_error(1.0, detail)) if detail else smooth_px

    @property
    def same_px(self) -> float:
        """Largest difference of radii that share one blur circle [photosites]; the error is proportional to it."""
        smooth_px = SAME_PX * min(self.looser, 2.0)
        return min(smooth_px, self.allowed / crossing_error(1.0, self.detail)) if self.detail else smooth_px

    def same_px_at(self, radius_px: np.ndarray) -> np.ndarray:
        """`same_px` of circles of these radii: less where those of a scene of one pixel per photosite show its edges.

        A disk of the radius R that grows by d gains 2 d / R of the difference of its rim and its inside. Of pixels in its area,
        black and white and one to eight photosites wide, 99.9 % of the photosites keep below 1.3 d / R, and below 2 d where
        it has just entered the four beside its own.
        """
        share = np.minimum(2.0, 1.3 / np.maximum(np.abs(radius_px), 0.5)) * self.pixel_detail
        return np.minimum(self.same_px, self.allowed / np.maximum(share, 1e-30))

    @property
    def slope_step(self) -> float:
        """Step to which slopes of the radius are rounded [photosites per photosite]; the error is proportional to it."""
        return max(SLOPE_STEP * min(self.looser, 2.0), 0.002)

    @property
    def points_factor(self) -> float:
        """Factor on the number of aperture samples at MEASURED; their error falls as their number to the power of -0.8."""
        return self.looser**-1.25

    @property
    def coarser(self) -> float:
        """Factor on the width of the radius slabs at MEASURED; it is at least 1 because narrower slabs were not measured."""
        return min(max(0.5 * self.looser, 1.0), 4.0)

    def samples_per_axis(self, least_px: np.ndarray, largest_px: np.ndarray, scale: float) -> np.ndarray:
        """Samples per photosite and axis, 1, 2 or 4, for blur circles between these radii [photosites].

        A grid is never finer than the scene, unless borders of the scene's pixels would cross its samples.

        scale: scene pixels per photosite.
        """
        if self.detail:
            return self._samples_of_squares(least_px, largest_px, scale)
        good = [grid_error(least_px, count, scale) <= self.allowed for count in (1, 2)]
        good[0] &= lamp_error(self.peak, least_px, scale) <= self.allowed
        needed = np.where(good[0], 1, np.where(good[1], 2, 4))
        there = 1 if scale < 1.5 else 2 if abs(scale - 2.0) < 1e-6 else 4
        return np.where(largest_px * min(self.looser, 1.0) <= FINE_PX, np.minimum(needed, there), 1)

    def allowed_disagreement(self, is_guessed: bool) -> tuple[float, float]:
        """Squared difference between a block's means over half and all of its points of the aperture at which these suffice.

        Returns its slope over light and its value in the dark, in the mosaic's unit: the noise at each place counts.
        is_guessed: whether the background behind edges is assumed, whose error no number of points lowers: then what is allowed
        is not below MEASURED.
        """
        allowed = AGREED * (max(self.allowed, MEASURED) if is_guessed else self.allowed) * self.brightest
        variance_e = max(self.electrons + self.read_noise_e**2, 1.0)
        square = allowed**2 / variance_e
        return square * self.electrons_per_radiance, square * max(self.read_noise_e**2, 1.0)

    def allowed_ray_error(self, light: np.ndarray) -> np.ndarray:
        """Largest standard error of the light of photosites by rays, in its unit; noise below 1 e- counts as 1 e-."""
        variance_e = self.electrons_per_radiance * np.maximum(light, 0.0) + self.read_noise_e**2
        return self.ray_error * np.sqrt(np.maximum(variance_e, 1.0)) / self.electrons_per_radiance

    def _samples_of_squares(self, least_px: np.ndarray, largest_px: np.ndarray, scale: float) -> np.ndarray:
        """`samples_per_axis` of a scene finer than the photosites, whose pixels are even squares."""
        counts = [count for count in SAMPLES_PER_AXIS if not self.whole_pixels or count <= self.whole_pixels]
        good = [self.sampling_error(least_px, count, scale) <= self.allowed for count in counts[:-1]]
        for count, is_good in zip(counts[:-1], good, strict=True):
            is_good &= (count > 1 and not self.whole_pixels) | (lamp_error(self.peak, least_px, scale) <= self.allowed * count)
        needed = np.select(good, counts[:-1], counts[-1]) if good else np.full(least_px.shape, counts[-1])
        return np.where(largest_px * min(self.looser, 1.0) <= FINE_PX, needed, 1)

    def sampling_error(self, radius_px: np.ndarray, samples_per_axis: int, scale: float) -> np.ndarray:
        """Error of so many samples per photosite and axis, as a share of the brightest light."""
        if not self.detail:
            return grid_error(radius_px, samples_per_axis, scale)
        if self.whole_pixels and samples_per_axis >= self.whole_pixels:
            return 0.0 * radius_px
        smooth = grid_error(radius_px, samples_per_axis, scale)
        return np.maximum(smooth, square_error(radius_px, samples_per_axis, scale, self.detail))

    def samples_suffice(self, least_px: np.ndarray, scale: float) -> np.ndarray:
        """Whether the most samples per photosite and axis are exact enough for blur circles from this radius on [photosites].

        Lamps are too few for `detail`. Samples hold them where they divide pixels.
        """
        finest = SAMPLES_PER_AXIS[-1]
        suffice = self.sampling_error(least_px, finest, scale) <= self.allowed
        if self.whole_pixels or not self.has_lamps:
            return suffice
        return suffice & (lamp_error(self.peak, least_px, scale) <= self.allowed * finest)

    def gathering_error(self) -> float:
        """Error of gathering the scene's pixels through an aperture of rectangles, as a share of the brightest light."""
        return 6e-4 * self.detail

    def in_sigma(self, share: float) -> float:
        """Convert an error from a share of the brightest light to standard deviations."""
        return share / self.sigma


@overload
def grid_error(radius_px: float, samples_per_axis: int, scale: float) -> float: ...
@overload
def grid_error(radius_px: np.ndarray, samples_per_axis: int, scale: float) -> np.ndarray: ...
def grid_error(radius_px: float | np.ndarray, samples_per_axis: int, scale: float) -> float | np.ndarray:
    """Error of sampling a photosite at a grid of points, as a share of the brightest light.

    It bounds sinusoids of 9 photosites and edges for radii of 0.7 to 15.5 photosites. It is larger where the scene, of `scale`
    pixels per photosite, is finer than the grid, because samples are then means over scene pixels instead of values.
    """
    return (0.025 if samples_per_axis >= scale else 0.04) / (samples_per_axis**2 * (np.abs(radius_px) + 1.0))


def blurred_share(radius_px: float, scale: float) -> float:
    """Share of the second difference between a scene's pixels that a blur circle leaves between photosites, at most 1.

    The pixels of a coarse scene are connected by slopes, whose shortest wave has two of them: the envelope of 2 J1(a) / a with
    a = pi radius scale. Steps of a scene as fine as the photosites end in a penumbra, which begins as the root of the way.
    """
    if scale < 1.0:
        a = math.pi * radius_px * scale
        return min(2.0 * math.sqrt(2.0 / math.pi) * a**-1.5, 1.0) if a > 0.0 else 1.0
    return min(radius_px**-1.5, 1.0) if radius_px > 0.0 else 1.0


def twice_blurred_share(radius_px: float, scale: float) -> float:
    """Share of a parabola's error that is left where samples are means over photosites, whose weights take a mean once more.

    The samples of a scene of fewer pixels than photosites are such means. Of a circle inside a photosite little is left. It
    bounds 99.9 % of the photosites of random pixels, 0.3 to 0.95 to a photosite, for this radius and all larger ones.
    """
    share = blurred_share(radius_px, scale)
    return min(0.55, 1.4 * share) if scale < 1.0 else share


def lamp_error(peak: float, radius_px: np.ndarray, scale: float) -> np.ndarray:
    """Error of one sample per photosite at the edge of the blur spot of a lamp that covers one scene pixel."""
    return 0.5 * (peak - 1.0) / (max(scale, 1.0) ** 2 * math.pi * np.maximum(radius_px, 0.5) ** 2)


def lamp_px(peak: float, allowed: float, scale: float) -> float:
    """Smallest blur radius for which `lamp_error` stays within what is allowed [photosites]; 0: there is no lamp."""
    return math.sqrt(0.5 * (peak - 1.0) / (max(scale, 1.0) ** 2 * math.pi * allowed)) if peak >= LAMP_PEAK else 0.0


def copy_error(radius_px: float) -> float:
    """Error of ignoring a blur circle, for a sinusoid of 9 photosites whose amplitude is half of the light.

    The blur removes 1 - 2 J1(a)/a = a^2 / 8 of the amplitude, with a = 2 pi radius / period.
    """
    return 0.5 * (2.0 * math.pi * radius_px / 9.0) ** 2 / 8.0


def crossing_error(radius_px: float, detail: float) -> float:
    """Error of ignoring a small blur circle in a fine scene: light that crosses the borders of photosites.

    At an edge along a border it is the mean of |x| over half the disk, 2 / (3 pi) radii. Four borders, and 99 % of the
    photosites of a scene of random pixels, stay below half of a radius.
    """
    return 0.5 * radius_px * detail


def square_error(radius_px: np.ndarray, samples_per_axis: int, scale: float, detail: float) -> np.ndarray:
    """Error of samples that mix several pixels of a fine scene or parts of them, as a share of the brightest light.

    It bounds 99 % of the photosites of a scene of random pixels for radii of 0.1 to 4 photosites. A sample with more than two
    pixels on a side averages their differences.
    """
    mixed = min(1.0, 2.0 * samples_per_axis / scale)
    far = 0.08 / (samples_per_axis**2 * np.maximum(np.abs(radius_px), 1e-3) ** 1.5)
    return detail * mixed * np.minimum(0.14 / samples_per_axis**1.5, far)


def slope_error(step: float) -> float:
    """Error of rounding slopes to multiples of `step`, for sinusoids of 14 and 16 photosites: 0.05 per unit of slope."""
    return 0.05 * step / math.sqrt(2.0)


@overload
def product_error(radius_px: float, step: float) -> float: ...
@overload
def product_error(radius_px: np.ndarray, step: float) -> np.ndarray: ...
def product_error(radius_px: float | np.ndarray, step: float) -> float | np.ndarray:
    """Error of replacing the mean of a product of two layers, one in focus, over a photosite's area by that of their means.

    The light or coverage of the layer out of focus has the slope of a penumbra, 2 / (pi R). Times the slope of a sinusoid of 24
    photosites and a fifth of the light that is over 12; times the step of an edge in the middle of the photosite over 8.

    step: of the layer in focus within photosites, of a scene finer than they are: up to 1, the edge of a hole. 0: it has none.
    """
    return max(0.0027, step / (4.0 * math.pi)) / np.maximum(np.abs(radius_px), 0.5)


def points_error(points: int, samples_per_axis: int, radius_px: float) -> float:
    """Error of the layers' covariance over the aperture from so many samples, as a share of `LayerContrast.over_points`.

    Sums over n points miss areas with borders by n to the power of -3/4 at best (Beck and Chen, Irregularities of Distribution,
    1987). Between samples light is linear, so that points which lie closer to each other miss less, in proportion. It bounds
    99.9 % of the photosites of edges before stripes, and of dark and bright squares of 2 to 8 photosites on both layers, whose
    circles have radii of 1.5 to 12. Of several samples each has its share of the points, and an error of its own.

    radius_px: of the largest circle.
    """
    apart = radius_px * math.sqrt(math.pi / points) * samples_per_axis**2  # points of one sample [samples]
    return 0.42 * math.sqrt(samples_per_axis) * points**-0.75 * min(apart, 1.0)


def relaxed_error(points: int, radius_px: float) -> float:
    """The same from points that are relaxed (`relaxed_points`), at one sample per photosite.

    They miss 0.82 of what Sobol' points do of random half-planes within random half-planes, of any angle (p99.9 in float64, 32
    to 1024 points), so that the factor is 0.35. They lie evenly on all scales above their own distance, so that what they miss
    are shorter waves, of which light that is linear between samples has less by the square of that distance in samples. It
    bounds 99.9 % of the photosites of the scenes above.
    """
    apart = radius_px * math.sqrt(math.pi / points)
    return 0.35 * points**-0.75 * min(apart, 1.0) ** 2


def small_circles_error(
    smaller_px: float, apart_px: float, samples_per_axis: int, scale: float, *, has_squares: bool = False
) -> float:
    """Error of two layers whose light is averaged over samples before it is multiplied, as a share of `SceneContrast.within`.

    What lies within a sample hides its other part, and layers with nearly the same circle hide the same parts at each point of
    the aperture. That is a covariance within samples, at most a quarter, whose signs differ from sample to sample. A circle
    that lies inside a photosite of one scene pixel is seen through one point, so that it has none. Of larger ones some apart^2
    pairs of pixels meet over the aperture, whose mean falls as 1 / apart. Of samples that are even squares nothing is hidden
    within them but what a circle brings there: the share of it that crosses their borders, found in squares of 1 and 3 pixels
    before others, at 2 and 4 samples. In a scene with fewer pixels than photosites light rises evenly within them, by their
    scale.

    smaller_px: radius of the smaller circle. apart_px: difference of the signed radii. scale: scene pixels per photosite.
    has_squares: whether points of the aperture read samples that are even squares (`PhotositeArea.has_squares`). It bounds
    99.9 % of the photosites of random squares and of random pixels, black and white and grey, on both layers: 2 to 8
    pixels per photosite and 2 or 4 samples in float64, 0.5 to 1 against rays; and 98 % of 1,800 pairs of patterns, waves
    and edges of 0.25 to 0.9 bilinear pixels per photosite, of any two circles, in float64.
    """
    if abs(scale - 1.0) < 1e-3:
        return MOST_COVARIANCE * min(ALIKE_PX / max(apart_px, 1e-3), 1.0) if smaller_px > 0.5 else 0.0
    if scale < 1.0:
        return 0.1 * scale
    wide = max(2.0 / samples_per_axis, 1.0)
    size_px = max(smaller_px / wide, 1e-3)
    small = 0.065 * min(size_px / 0.25, (0.25 / size_px) ** 2)
    alike = 0.165 * min(0.18 / max(apart_px / wide, 1e-3), 1.0) * min(1.2 / size_px, 1.0)
    crossed = 1.0 - math.exp(-smaller_px * samples_per_axis / SQUARES_CROSSED) if has_squares else 1.0
    return wide * (small + alike) * crossed


def occlusion_error(points: int) -> float:
    """Error of surfaces that are sampled through so many points of the aperture where they occlude parts of themselves.

    It bounds 99 % of the photosites of photographs with depth and of random textures, for 128 to 4096 points.
    """
    return 1.2 * points**-0.72


def slab_error(classes_per_unit: float) -> float:
    """Error of dividing a surface with steps in depth into slabs of radius (`Defocus.classes_per_unit`).

    It bounds 99 % of the photosites of photographs with depth and of uniform layers, for 6 to 24 classes per unit.
    """
    return 0.1 / classes_per_unit


def wide_error(wide_px: float) -> float:
    """Error of light on photosites twice as wide, for the smallest blur radius (`Defocus.wide_px`): the end of a penumbra."""
    return 0.0025 * (WIDE_PX / wide_px) ** 1.5


def hidden_error(contrast: float, radius_px: float = math.inf) -> float:
    """Error of a background behind edges that the scene does not show, where the light there differs by so much.

    Beside an edge up to half of the aperture sees it. From there to the rim of the circle, of this radius [photosites], that
    share falls to 0, and its mean is 2 / (3 pi): of a circle smaller than a photosite no more is hidden than along four of its
    borders. The pictures with depth of the audit have at most 0.34 of the contrast, with a background that is extended or
    without any.
    """
    return min(0.5, 8.0 / (3.0 * math.pi) * radius_px) * contrast
