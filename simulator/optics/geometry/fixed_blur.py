"""Blur that is the same at each instant: when the light of a moving scene may be swept first, and blurred once.

Behind the lens a photosite gathers light from the places around it. Where that is one linear operator on the light of one
picture, whatever the instant, the mean over time of the blurred images is the blur of the mean over time: exactly, whatever the
operator does over the field, and whatever the motion. Three things break it, each with a law:

- Lines that open one after the other gather light of lines that are open at other times. An image that moves by k photosites
  from line to line shears the spot by k, which stretches its spread across an edge by k / 2 at most. The light at x from an
  edge of contrast C is then wrong by C x l(x) k / 2, with l the spread of a line. x l(x) is at most 1/2 for a spread with one
  peak, 0.32 for an even disk. While an edge passes, errors of both signs cancel. What is left at the ends of a path of L
  photosites is at most k C e / (4 L), with e the mean distance of the spot's light from a line through its middle.
  Where all places move evenly by a vector k from row to row, that is undone exactly. Row y sees at y + d what rows at y + d
  would see (d, down) k earlier or later, so that the light swept by each row at its own time is that of one time, skewed: the
  place d of it lies at d' with d' + k d'_y = d. Spots that are skewed alike gather from it what the spot gathers from the light
  of one time. What is left is the law above for the difference of motions from their middle, and, where photosites have several
  samples, which rows of samples share a time, for the spread of the photosite itself.
- A blur radius that differs from place to place goes along with the picture, but light is blurred by the radii of the middle of
  the path. Where the radius R changes by g from photosite to photosite, an edge at the end of a path of L photosites is blurred
  by a radius that is wrong by g L / 2, with opposite signs before and after the middle. The light of an edge of contrast C is
  wrong by less than C g L / (2 pi R), by the steepest change of an even disk's spread of an edge with R, and by less than
  0.21 C g, since that change is 2 / (3 pi) on either side over the whole way of an edge.
- Light that is sampled on a grid before it is blurred: `squares_left` of random black and white squares, and the spots of lamps
  (`lamp_laws`), as of a scene at rest. Where instants are gathered from the scene's pixels they have nothing of it. Else they
  are sampled alike, and have as much. A path does not lessen it: edges along it stay in their sample.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

LEVER = 0.25  # largest error of an edge behind a spot sheared by 1, in units of its contrast
TILT_LEVER = 2.0 / (3.0 * math.pi)  # largest error of an edge, of contrast 1 and change of the radius per photosite
DISK_SPREAD = 4.0 / (3.0 * math.pi)  # mean distance of an even disk's light from a line through its middle [radii]
MOST_SKEW = 0.5  # way from row to row up to which spots are skewed: beyond it light is too dense on its samples [photosites]


@dataclass(frozen=True)
class Skew:
    """Way of what a line of the sensor sees, from line to line [photosites].

    x_px, y_px: the middle of all places and instants. apart_px: largest distance of one from it. largest_px: of all.
    of_rows: whether the lines are rows.
    """

    x_px: float = 0.0
    y_px: float = 0.0
    apart_px: float = 0.0
    largest_px: float = 0.0
    of_rows: bool = True

    @property
    def middle_px(self) -> float:
        """Length of the middle."""
        return math.hypot(self.x_px, self.y_px)


@dataclass(frozen=True)
class FixedBlur:
    """A blur that is the same at each instant, or nearly so.

    samples_per_axis: samples of the light per photosite and axis that it gathers. contrast: of the scene's edges, as a share of
    the brightest light. spread_px: mean distance of a spot's light from a line through its middle [photosites].
    sampling_error: of the samples, as a share of the brightest light, which sums of instants do not have. common_error,
    lamp_error: which they have as well, of squares and of lamps. slope: largest change of the blur radius from photosite to
    photosite. least_px: blur radius where it is smallest [photosites].
    own_spread_px: `spread_px` of what is not skewed with the spot. can_skew: whether spots can be skewed.
    followed: motion from line to line with which spots are skewed; None: they are as they are.
    """

    samples_per_axis: int
    contrast: float
    spread_px: float
    sampling_error: float = 0.0
    common_error: float = 0.0
    lamp_error: float = 0.0
    slope: float = 0.0
    least_px: float = 0.0
    own_spread_px: float = 0.0
    can_skew: bool = False
    followed: Skew | None = None

    def following(self, skew: Skew) -> Self:
        """Return the blur of skewed spots, where they can be skewed and are wrong by less."""
        can_follow = self.can_skew and skew.of_rows and skew.middle_px <= MOST_SKEW and self.slope == 0.0
        return replace(self, followed=skew) if can_follow and skew.apart_px < skew.largest_px else self

    @property
    def spot_skew(self) -> tuple[float, float]:
        """Skew of the spots, as of `Pupil.skew`."""
        if self.followed is None:
            return 0.0, 0.0
        down = 1.0 / (1.0 + self.followed.y_px)
        return -self.followed.x_px * down, down - 1.0

    def skew_error(self, skew: Skew, length_px: float) -> float:
        """Return the error of lines that open one after the other, as a share of the brightest light.

        length_px: of the path while a line is open [photosites].
        """

        def sheared(way_px: float, spread_px: float) -> float:
            passed = 0.25 * spread_px / length_px if length_px > 0.0 else math.inf
            return self.contrast * way_px * min(LEVER, passed)

        if self.followed is None:
            return sheared(skew.largest_px, self.spread_px)
        return sheared(skew.apart_px, self.spread_px) + sheared(skew.middle_px, self.own_spread_px)

    def tilt_error(self, length_px: float) -> float:
        """Return the error of radii that are those of the middle of a path, as a share of the brightest light."""
        steepest = 0.5 * length_px / (math.pi * self.least_px) if self.least_px > 0.0 else math.inf
        return self.contrast * self.slope * min(TILT_LEVER, steepest)

    def error(self, skew: Skew, length_px: float) -> float:
        """Return the error of all, as a share of the brightest light; infinite where lines see radii at times of their own."""
        if self.slope and skew.largest_px > 0.0:
            return math.inf
        return self.sampling_error + self.skew_error(skew, length_px) + self.tilt_error(length_px)
