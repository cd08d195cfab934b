"""Metering: which exposure brings a scene to its level, from the light that falls on the cells of a frame.

Light is in electrons of a photosite per unit of exposure, so that all that is solved for is one number: the exposure over the
electrons at white. Cells above white count as white, as they do in the picture that a camera meters on, so that a lamp does
not darken all of it. Then the level rises with the exposure, and the exposure of a level is found exactly, by sorting.
Motion and flicker of lamps are not metered.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.sensor.iso_speed import METERED_LEVEL

CENTRE_WEIGHT = 0.75  # of the light in the middle circle
CENTRE_DIAMETER = 0.5  # of that circle, in heights of the frame: 12 mm of 24 mm
PROTECTED = (0.98, 1.0, 0.8)  # quantiles of the brightest cells, and their level (libcamera, imx477.json, "highlight")


@dataclass(frozen=True)
class LevelBound:
    """Bound on the mean of the cells between two quantiles of brightness (libcamera's constraint modes).

    bound: whether the level is the least or the most that this mean may have.
    from_quantile, to_quantile: 0 is the darkest cell, 1 the brightest.
    level: share of white, above 0 and below 1.
    """

    bound: Literal["least", "most"]
    from_quantile: float
    to_quantile: float
    level: float

    def __post_init__(self) -> None:
        is_range = 0.0 <= self.from_quantile < self.to_quantile <= 1.0
        value = f"{self.from_quantile:g} to {self.to_quantile:g}"
        require(is_range, "exposure.metering.bounds.from_quantile", value, "give a range within 0 to 1, such as 0.98 to 1")
        require(0 < self.level < 1, "exposure.metering.bounds.level", self.level, "give a share of white, such as 0.8")

    def describe(self) -> str:
        """Return the bound in words."""
        share = f"cells from {100 * self.from_quantile:g} to {100 * self.to_quantile:g} % of brightness"
        return f"{share} at {self.bound} {100 * self.level:g} % of white"


@dataclass(frozen=True)
class Metering:
    """How a camera meters.

    pattern: mean of the frame; centre_weighted, three quarters of the weight in a circle half as wide as the frame is high;
        spot, a circle; highlights, the mean, but the brightest 2 % at most 80 % of white.
    x, y: centre of the spot, in shares of the frame's width and height from its upper left corner, 0 to 1.
    size: diameter of the spot, in heights of the frame, above 0 and up to 1.
    level: share of white that the metered light gets; 10/78 is what ISO 12232 leaves for a grey of 18 % and half a stop.
    bounds: limits on the level of dark or bright parts of the frame, the later ones stronger.
    """

    pattern: Literal["mean", "centre_weighted", "spot", "highlights"] = "centre_weighted"
    x: float = 0.5
    y: float = 0.5
    size: float = 0.1
    level: float = METERED_LEVEL
    bounds: tuple[LevelBound, ...] = ()

    def __post_init__(self) -> None:
        for key, value in (("x", self.x), ("y", self.y)):
            require(0 <= value <= 1, f"exposure.metering.{key}", value, "give a share of the frame, 0 to 1")
        require(0 < self.size <= 1, "exposure.metering.size", self.size, "give a share of the frame's height, such as 0.1")
        require(0 < self.level < 1, "exposure.metering.level", self.level, "give a share of white, such as 0.128")
        placed = (self.x, self.y, self.size) != (Metering.x, Metering.y, Metering.size)
        rule = "x, y and size are those of a spot; leave them out, or write pattern: spot"
        require(self.pattern == "spot" or not placed, "exposure.metering.pattern", self.pattern, rule)

    @property
    def all_bounds(self) -> tuple[LevelBound, ...]:
        """Bounds as stated, and that of the pattern."""
        return (*self.bounds, LevelBound("most", *PROTECTED)) if self.pattern == "highlights" else self.bounds

    def weights(self, rows: int, columns: int) -> np.ndarray:
        """Return the weight of each cell of a frame of square cells, (rows, columns) float64, with the sum 1."""
        if self.pattern == "spot":
            return _normalised(_circle(rows, columns, self.x, self.y, self.size))
        even = np.full((rows, columns), 1.0 / (rows * columns))
        if self.pattern != "centre_weighted":
            return even
        middle = _circle(rows, columns, 0.5, 0.5, CENTRE_DIAMETER)
        if float((1.0 - middle).sum()) < 0.5:
            return even  # of a frame of a cell or two
        return CENTRE_WEIGHT * _normalised(middle) + (1.0 - CENTRE_WEIGHT) * _normalised(1.0 - middle)


@dataclass(frozen=True)
class MeterReading:
    """What a meter found.

    exposure: wanted exposure in units of that at which a cell of light 1 has one electron at white of 1; infinite where even
        the longest does not reach the level. bound: the LevelBound that decided, in words; None: none did.
    """

    exposure: float
    bound: str | None = None


def _circle(rows: int, columns: int, x: float, y: float, diameter: float) -> np.ndarray:
    """Return the share of each cell in a circle, with an edge one cell wide; the nearest cell where it is smaller than one."""
    down, across = np.arange(rows)[:, None] + 0.5 - y * rows, np.arange(columns) + 0.5 - x * columns
    distance = np.hypot(down, across)
    inside = np.clip(0.5 * diameter * rows - distance + 0.5, 0.0, 1.0)
    return inside if inside.any() else (distance == distance.min()).astype(np.float64)


def _normalised(weights: np.ndarray) -> np.ndarray:
    return weights / weights.sum()


def exposure_for_level(light: np.ndarray, weights: np.ndarray, level: float) -> float:
    """Return the exposure w at which the weighted mean of min(w light, 1) is the level.

    light, weights: (cells,) float64, >= 0; the weights have the sum 1. Infinite where less than the level's share is lit.
    """
    lit = (light > 0) & (weights > 0)
    order = np.argsort(-light[lit], kind="stable")
    light, weights = light[lit][order], weights[lit][order]
    if not light.size:
        return math.inf
    white = np.concatenate([[0.0], np.cumsum(weights)[:-1]])  # weight of the cells brighter than each one
    rest = np.cumsum((weights * light)[::-1])[::-1]  # light of each cell and all darker ones
    reached = white + rest / light  # level at which each cell reaches white; it rises from cell to cell
    place = int(np.searchsorted(reached, level))
    return float((level - white[place]) / rest[place]) if place < light.size else math.inf


def read_meter(light: np.ndarray, brightest: np.ndarray, metering: Metering) -> MeterReading:
    """Return the exposure that a frame needs.

    light: (rows, columns) float64, of each cell in green, or in the one colour. brightest: the same, of the colour that has
    most, on which the bounds act, since any colour may clip.
    Raises PhotositeError where the metered part of the scene is black.
    """
    weights = metering.weights(*light.shape)
    if not float((weights * light).sum()) > 0.0:
        part = f"the spot at x = {metering.x:g}, y = {metering.y:g}" if metering.pattern == "spot" else "the frame"
        raise PhotositeError(
            f"{part} is black, there is nothing to meter; set exposure.mode: manual with exposure.time, or meter another part",
            key="exposure.metering.pattern",
            value=metering.pattern,
        )
    exposure, decided = exposure_for_level(light.ravel(), weights.ravel(), metering.level), None
    for bound in metering.all_bounds:
        limit = _exposure_for_bound(brightest.ravel(), bound)
        if (bound.bound == "most" and limit < exposure) or (bound.bound == "least" and exposure < limit < math.inf):
            exposure, decided = limit, bound.describe()
    return MeterReading(exposure, decided)


def _exposure_for_bound(light: np.ndarray, bound: LevelBound) -> float:
    """Return the exposure at which the mean of the cells between two quantiles of brightness is the level."""
    ascending, edges = np.sort(light), np.arange(light.size + 1) / light.size
    share = np.clip(edges[1:], bound.from_quantile, bound.to_quantile) - np.clip(
        edges[:-1], bound.from_quantile, bound.to_quantile
    )
    return exposure_for_level(ascending, _normalised(share), bound.level)
