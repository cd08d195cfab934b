"""Conversion gain: a pixel of dual gain can give more volts per electron (dual conversion gain)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage


@dataclass(frozen=True)
class ConversionGain(Stage):
    """signal = ratio * electrons: noise that follows counts less in electrons by this ratio.

    ratio: conversion gain over the low one, >= 1.
    """

    stem: ClassVar[str] = "conversion_gain"
    in_camera_stages: ClassVar[bool] = False
    neutral: ClassVar[dict[str, float]] = {"ratio": 1.0}
    changes_mean: ClassVar[bool] = True
    ratio: float

    def __post_init__(self):
        require(1 <= self.ratio <= 1000, "conversion_gain.ratio", self.ratio, "give the high gain over the low one, 1 to 1000")

    def moments(self, signal: Moments) -> Moments:
        """Give ratio mean, ratio^2 var."""
        return signal.scaled(self.ratio)

    @property
    def gain(self) -> float:
        """The ratio."""
        return self.ratio
