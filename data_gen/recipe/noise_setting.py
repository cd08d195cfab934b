"""The noise model of one sample: sensor stages with their parameters, and the levels that follow from them."""

import math
from dataclasses import dataclass
from functools import cached_property

from simulator.measurement.noise_check.expected import CLEAR_SIGMAS, is_clear_of_zero
from simulator.sensor.camera.camera import Camera
from simulator.sensor.kernel.kernel_program import signal_steps, stage_moments, white_level_dn
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.stage import Stage


def told_of_clipped_dark(label: str, where: str = "") -> str:
    """Return what is to be known of a camera or line of noise that clips dark codes. where: at which settings."""
    reason = f"its pedestal is below {CLEAR_SIGMAS:g} standard deviations of the dark"
    numbers = "black_level_dn and read_noise_dn are those without this clipping, which lit codes have"
    return f"{label}: codes of black end at 0{where}, since {reason}; {numbers}"


@dataclass(frozen=True)
class NoiseSetting:
    """A sensor at one setting.

    label: camera or prior, for people. iso: 0 where the noise model knows no ISO.
    camera: geometry and colours of the clean picture. stages: of the sensor, in physical order.
    """

    label: str
    iso: int
    camera: Camera
    stages: tuple[Stage, ...]

    @property
    def _adc(self) -> Adc:
        """The converter, which every sensor has."""
        return next(stage for stage in self.stages if isinstance(stage, Adc))

    @property
    def bit_depth(self) -> int:
        """Bits of a code."""
        return self._adc.bit_depth

    @cached_property
    def black_level_dn(self) -> float:
        """Mean code of a photosite without light [DN]: the pedestal, and the mean of the dark current where there is one.

        As in the truth of a shot, what differs between photosites or colours is noise: hot photosites, fixed patterns, colour
        bias. Codes that end at 0 are not part of it, so that lit codes scatter about black + light where black ones cannot.
        """
        return float(stage_moments(tuple(stage for stage in self.stages if stage.changes_mean), 0.0).mean)

    @cached_property
    def white_level_dn(self) -> int:
        """Code of a saturated photosite [DN]: of the full well or of the ADC, whichever is lower."""
        return white_level_dn(signal_steps(self.stages), self._adc.black_level_dn)

    @cached_property
    def gain_dn_per_e(self) -> float:
        """K of EMVA 1288 [DN/e-], everything between the charge and the code that multiplies."""
        return math.prod(stage.gain for stage in self.stages)

    @cached_property
    def read_noise_dn(self) -> float:
        """Standard deviation of the dark code in one frame [DN]: read noise, row noise, dark current, rounding.

        Codes that end at 0 are not part of it, as in `black_level_dn`.
        """
        return math.sqrt(stage_moments(self.stages, 0.0).variance)

    @property
    def clips_dark(self) -> bool:
        """Whether the pedestal is so low that codes without light end at 0."""
        return not is_clear_of_zero(stage_moments(self.stages, 0.0))

    @property
    def reference_electrons(self) -> float:
        """Mean photoelectrons at which the code reaches white from that without light: (white - black) / K [e-]."""
        return (self.white_level_dn - self.black_level_dn) / self.gain_dn_per_e
