"""Photon shot noise: photoelectrons are counted one by one (EMVA 1288 R4.0, section 2.2)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.sensor.stages.stage import Moments, Stage


@dataclass(frozen=True)
class PhotonShotNoise(Stage):
    """electrons ~ Poisson(mean electrons): the variance equals the mean, in e-."""

    stem: ClassVar[str] = "photon_shot_noise"
    counts_means: ClassVar[bool] = True

    def moments(self, signal: Moments) -> Moments:
        """Give var + mean (Poisson)."""
        return signal.plus(variance=signal.mean)
