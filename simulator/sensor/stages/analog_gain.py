"""Analog gain, which the ISO setting chooses: K of EMVA 1288 [DN/e-]."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import DigitalNumbersPerElectron


@dataclass(frozen=True)
class AnalogGain(Stage):
    """signal [DN] = gain * electrons.

    gain_dn_per_e: EMVA 1288's K [DN/e-], > 0.
    """

    stem: ClassVar[str] = "analog_gain"
    in_camera_stages: ClassVar[bool] = False
    changes_mean: ClassVar[bool] = True
    is_required: ClassVar[bool] = True
    gain_dn_per_e: DigitalNumbersPerElectron

    def __post_init__(self) -> None:
        require(self.gain_dn_per_e > 0, "analog_gain.gain", f"{self.gain_dn_per_e} DN/e-", "give a gain above 0 DN/e-")

    def moments(self, signal: Moments) -> Moments:
        """K mean, K^2 var."""
        return signal.scaled(self.gain_dn_per_e)

    @property
    def gain(self) -> float:
        """K [DN/e-]."""
        return self.gain_dn_per_e
