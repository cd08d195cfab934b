"""Blur that is the same at each instant: when the light of a moving scene may be swept first, and blurred once.

Behind the lens a photosite gathers light from the places around it. Where that is one linear operator on the light of one
picture, whatever the instant, the mean over time of the blurred images is the blur of the mean over time: exactly, whatever the
operator does over the field, and whatever the motion. Three things break it, each with a law:

- Lines that open one after the other gather light of lines that are open at other times. An image that moves by k photosites
  from line to line shears the spot by k, which stretches its spread across an edge by k / 2 at most. The light at x from an
  edge of contrast C is then wrong by C x l(x) k / 2, with l the spread of a line. x l(x) is at most 1/2 for a spread with one
  peak, 0.32 for an even disk. While an edge passes, errors of both signs cancel. What is left at the ends of a path of L
  photosites is at most k C e / (4 L), with e the mean distance of the spot's light from a line through its middle.
- A blur radius that differs from place to place goes along with the picture, but light is blurred by the radii of the middle of
  the path. Where the radius R changes by g from photosite to photosite, an edge at the end of a path of L photosites is blurred
  by a radius that is wrong by g L / 2, with opposite signs before and after the middle. The light of an edge of contrast C is
  wrong by less than C g L / (2 pi R), by the steepest change of an even disk's spread of an edge with R, and by less than
  0.21 C g, since that change is 2 / (3 pi) on either side over the whole way of an edge.
- Light that is sampled on a grid before it moves on: see `Accuracy.sampling_error`.
"""

import math
from dataclasses import dataclass

LEVER = 0.25  # largest error of an edge behind a spot sheared by 1, in units of its contrast
TILT_LEVER = 2.0 / (3.0 * math.pi)  # largest error of an edge, of contrast 1 and change of the radius per photosite
DISK_SPREAD = 4.0 / (3.0 * math.pi)  # mean distance of an even disk's light from a line through its middle [radii]


@dataclass(frozen=True)
class FixedBlur:
    """A blur that is the same at each instant, or nearly so.

    samples_per_axis: samples of the light per photosite and axis that it gathers. contrast: of the scene's edges, as a share of
    the brightest light. spread_px: mean distance of a spot's light from a line through its middle [photosites].
    sampling_error: of the samples, as a share of the brightest light. slope: largest change of the blur radius from photosite
    to photosite. least_px: blur radius where it is smallest [photosites].
    """

    samples_per_axis: int
    contrast: float
    spread_px: float
    sampling_error: float = 0.0
    slope: float = 0.0
    least_px: float = 0.0

    def skew_error(self, skew_px: float, length_px: float) -> float:
        """Return the error of lines that open one after the other, as a share of the brightest light.

        skew_px: way of the image from line to line. length_px: of the path while a line is open [photosites].
        """
        passed = 0.25 * self.spread_px / length_px if length_px > 0.0 else math.inf
        return self.contrast * skew_px * min(LEVER, passed)

    def tilt_error(self, length_px: float) -> float:
        """Return the error of radii that are those of the middle of a path, as a share of the brightest light."""
        steepest = 0.5 * length_px / (math.pi * self.least_px) if self.least_px > 0.0 else math.inf
        return self.contrast * self.slope * min(TILT_LEVER, steepest)

    def error(self, skew_px: float, length_px: float) -> float:
        """Return the error of all, as a share of the brightest light; infinite where lines see radii at times of their own."""
        if self.slope and skew_px > 0.0:
            return math.inf
        return self.sampling_error + self.skew_error(skew_px, length_px) + self.tilt_error(length_px)
