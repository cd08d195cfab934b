"""Conversion gain: pixels with dual conversion gain have a second, higher one [V/e-]."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage


@dataclass(frozen=True)
class ConversionGain(Stage):
    """signal = ratio * electrons: later noise, referred to electrons, is smaller by this ratio.

    ratio: conversion gain relative to the low one, >= 1.
    """

    stem: ClassVar[str] = "conversion_gain"
    in_camera_stages: ClassVar[bool] = False
    neutral: ClassVar[dict[str, float]] = {"ratio": 1.0}
    changes_mean: ClassVar[bool] = True
    ratio: float

    def __post_init__(self) -> None:
        require(1 <= self.ratio <= 1000, "conversion_gain.ratio", self.ratio, "give the high gain over the low one, 1 to 1000")

    def moments(self, signal: Moments) -> Moments:
        """Give ratio mean, ratio^2 var."""
        return signal.scaled(self.ratio)

    @property
    def gain(self) -> float:
        """Ratio of the conversion gains."""
        return self.ratio
