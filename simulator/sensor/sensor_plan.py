"""The sensor's part of a plan: which photosites are computed, through which stages, and what mean and noise come out."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Self

import numpy as np

from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.readout_window import ReadoutGeometry, plan_readout
from simulator.sensor.kernel.kernel_program import in_order, signal_steps, white_level_dn
from simulator.sensor.stages.stage import Moments, SignalStep, Stage


@dataclass(frozen=True)
class SensorPlan:
    """All that is decided between the light on the sensor and the codes.

    readout: which photosites are computed, read and given out. stages: of the fused kernel, those that have an effect, in
    physical order.
    """

    camera: Camera
    readout: ReadoutGeometry
    stages: tuple[Stage, ...]

    def stage(self, stem: str) -> Stage | None:
        """The fused stage of this stem, or None when it is skipped."""
        return next((stage for stage in self.stages if stage.stem == stem), None)

    def with_stages(self, stages: Iterable[Stage]) -> Self:
        """Return the plan with other stages; those of no effect are left out."""
        return replace(self, stages=in_order(stages))

    def at(self, iso: float, exposure_time_s: float) -> Self:
        """Return the plan of the same light path at another ISO and exposure time [s].

        Raises PhotositeError for an ISO that the camera does not have.
        """
        light = [stage.of_shot(exposure_time_s=exposure_time_s) for stage in self.stages if stage.acts_on_light]
        return self.with_stages([*light, *self.camera.sensor_stages(iso, exposure_time_s).values()])

    def moments(self, mean_electrons: float) -> Moments:
        """Mean and variance of the code [DN] for a photosite that expects these photoelectrons."""
        signal = Moments(mean_electrons, 0.0)
        for step in self.moment_steps():
            signal = step.moments(signal)
        return signal

    def moment_steps(self) -> list[SignalStep]:
        """Effect on mean and variance of everything from the photoelectrons to the code, in physical order."""
        sensor, binning = [stage for stage in self.stages if not stage.acts_on_light], self.readout.binning
        crosstalk = SignalStep("crosstalk", self.readout.crosstalk.of_charge)
        if binning is None:
            return signal_steps(sensor, [crosstalk])
        steps = signal_steps(sensor, [crosstalk, SignalStep("binning", binning.of_charge)])
        return [*steps, SignalStep("binning", binning.of_code)]

    @property
    def black_level_dn(self) -> float:
        """Pedestal [DN]."""
        return self.stage("adc").black_level_dn

    def white_level_dn(self) -> int:
        """Code of a saturated photosite: of the full well or of the ADC, whichever is lower; above black [DN]."""
        return white_level_dn(self.moment_steps(), self.black_level_dn)

    def full_scale_dn(self) -> float:
        """White level less black level [DN]."""
        return self.white_level_dn() - self.black_level_dn

    def gain_dn_per_e(self) -> float:
        """Slope of the mean code over the photoelectrons in the dark, of all stages together [DN/e-]."""
        return self.moments(1.0).mean - self.moments(0.0).mean

    def electrons_at_white(self) -> float:
        """Photoelectrons that bring the mean code from the dark's to the white level, linearly [e-].

        The dark's mean code holds the dark current, which fills a part of the range. The gain must be above 0.
        """
        return (self.white_level_dn() - self.moments(0.0).mean) / self.gain_dn_per_e()

    def black_offsets_dn(self) -> tuple[float, float, float, float]:
        """What stages add to the black level at the four places of the frame's upper left 2x2 block, row by row [DN]."""
        block, output = np.zeros((2, 2)), self.readout.output
        for place, stage in enumerate(self.stages):
            if stage.black_offsets_dn is not None:
                block += _added_to_code(stage.black_offsets_dn, self.stages[place + 1 :])
        return tuple(float(offset) for offset in np.roll(block, (-output.y % 2, -output.x % 2), axis=(0, 1)).ravel())

    def noise_profile(self) -> tuple[float, float]:
        """S and O of DNG's NoiseProfile: variance = S x + O, x from 0 at black to 1 at white (DNG 1.4)."""
        dark, one = Moments(0.0, 0.0), Moments(1.0, 0.0)
        for step in self.moment_steps():
            dark, one = step.unclipped(dark), step.unclipped(one)
        slope = (one.variance - dark.variance) / (one.mean - dark.mean)
        return slope / self.full_scale_dn(), dark.variance / self.full_scale_dn() ** 2


def _added_to_code(offsets_dn: Iterable[float], later: tuple[Stage, ...]) -> np.ndarray:
    """What offsets of the signal at the four places of a 2x2 block add to the code behind the later stages (2, 2) [DN]."""

    def code_dn(signal_dn: float) -> float:
        return reduce(lambda signal, stage: stage.moments(signal), later, Moments(signal_dn, 0.0)).mean

    return np.reshape([code_dn(offset) - code_dn(0.0) for offset in offsets_dn], (2, 2))


def plan_sensor(camera: Camera, light: Iterable[Stage], iso: float, exposure_time_s: float) -> SensorPlan:
    """Plan what the sensor does with the light of one exposure.

    light: stages between the lens's radiance and the photoelectrons (irradiance, exposure).
    Raises PhotositeError for an ISO that the camera does not have, and a window that cuts through binned blocks.
    """
    stages = [*light, *camera.sensor_stages(iso, exposure_time_s).values()]
    return SensorPlan(camera, plan_readout(camera), in_order(stages))
