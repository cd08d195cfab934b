"""The sensor's part of a plan: the computed photosites, the stages, and the mean and noise of the codes."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Self

import numpy as np

from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.readout_window import ReadoutGeometry, plan_readout
from simulator.sensor.kernel.kernel_program import CHARGE_STAGES, READOUT_STAGES, in_order, signal_steps, white_level_dn
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.irradiance import Irradiance
from simulator.sensor.stages.stage import Moments, SignalStep, Stage


@dataclass(frozen=True)
class NoiseFloor:
    """The least noise of an exposure at any ISO of its camera, which the accuracy of the optics refers to.

    most_electrons: photoelectrons that saturate a photosite at the ISO that holds most of them, rounded up to a power of two.
    read_noise_e: least noise in the dark, in photoelectrons, rounded down to a power of the square root of two; 0: none.
    has_shot_noise: whether photons are counted with their noise.
    """

    most_electrons: float
    read_noise_e: float
    has_shot_noise: bool = True

    def moments(self, mean_electrons: float) -> Moments:
        """Return mean and variance [e-, e-^2] of a photosite with this mean number of photoelectrons; never without noise."""
        shot_e2 = mean_electrons if self.has_shot_noise else 0.0
        return Moments(mean_electrons, max(shot_e2 + self.read_noise_e**2, 1e-6))


@dataclass(frozen=True)
class SensorPlan:
    """Everything that determines how light on the sensor becomes codes.

    readout: photosites that are computed, read and given out. stages: stages of the fused kernel that have an effect, in
    physical order.
    """

    camera: Camera
    readout: ReadoutGeometry
    stages: tuple[Stage, ...]

    def stage(self, stem: str) -> Stage | None:
        """Return the stage of this stem, or None when the plan has none."""
        return next((stage for stage in self.stages if stage.stem == stem), None)

    @property
    def irradiance(self) -> Irradiance:
        """Stage that turns radiance into irradiance, which every shot has."""
        stage = self.stage("irradiance")
        assert isinstance(stage, Irradiance)
        return stage

    @property
    def exposure(self) -> Integration:
        """Stage that integrates irradiance over area and time, which every shot has."""
        stage = self.stage("exposure")
        assert isinstance(stage, Integration)
        return stage

    @property
    def spilling_stages(self) -> tuple[Stage, ...]:
        """Stages of a sensor whose charge above the full well is not drained at once, but spills into neighbours."""
        return tuple(stage for stage in self.stages if self.readout.blooming is None or not isinstance(stage, FullWell))

    @property
    def capacity_e(self) -> float:
        """Electrons that a photosite holds; infinite without a full well [e-]."""
        return next((stage.capacity_e for stage in self.stages if isinstance(stage, FullWell)), math.inf)

    def with_stages(self, stages: Iterable[Stage]) -> Self:
        """Return the plan with these stages instead; those without effect are left out."""
        return replace(self, stages=in_order(stages))

    def at(self, iso: float, exposure_time_s: float) -> Self:
        """Return the plan for the same camera and lens at another ISO and exposure time [s].

        Raises PhotositeError for an ISO that the camera does not have.
        """
        light = [stage.of_shot(exposure_time_s=exposure_time_s) for stage in self.stages if stage.acts_on_light]
        return self.with_stages([*light, *self.camera.sensor_stages(iso, exposure_time_s).values()])

    def moments(self, mean_electrons: float) -> Moments:
        """Return mean and variance of the code [DN] for a photosite with this mean number of photoelectrons."""
        steps, own_electrons = self.steps_at(mean_electrons)
        return reduce(lambda signal, step: step.moments(signal), steps, Moments(own_electrons, 0.0))

    def moment_steps(self) -> list[SignalStep]:
        """Return the steps from the photoelectrons to the code that change mean or variance, in physical order."""
        sensor, binning = [stage for stage in self.stages if not stage.acts_on_light], self.readout.binning
        crosstalk = SignalStep("crosstalk", self.readout.shared_moments)
        if binning is None:
            return signal_steps(sensor, [crosstalk])
        steps = signal_steps(sensor, [crosstalk, SignalStep("binning", binning.of_charge)])
        if self.readout.averages:
            of_rows = {one.stem: binning.of_rows(one, self.readout.filter_step) for one in sensor if one.is_common_to_rows}
            steps = [of_rows.get(step.name, step) for step in steps]
        return [*steps, SignalStep("binning", binning.of_code)]

    def charge_steps(self) -> list[SignalStep]:
        """Return the steps from the photoelectrons to the charge that a photosite collects, before any is shared or summed."""
        return [step for step in self.moment_steps() if step.name in CHARGE_STAGES]

    def readout_steps(self) -> list[SignalStep]:
        """Return the steps from the charge that is read out, mixed and summed, to the code."""
        return read_out_of(self.moment_steps())

    def row_noise_dn2(self) -> dict[Stage, float]:
        """Return the variance of the code [DN^2] by each stage that is common to rows, without clipping."""
        all_dn2 = self._unclipped(0.0).variance
        common = [one for one in self.stages if one.is_common_to_rows]
        rest = {one: self.with_stages(other for other in self.stages if other is not one) for one in common}
        return {one: all_dn2 - plan._unclipped(0.0).variance for one, plan in rest.items()}

    @property
    def black_level_dn(self) -> float:
        """Pedestal [DN]."""
        return self.adc_range[0]

    @property
    def adc_range(self) -> tuple[float, int]:
        """Pedestal and largest code of the ADC [DN]."""
        adc = self.stage("adc")
        assert isinstance(adc, Adc)  # Camera.sensor_stages always gives one
        return adc.black_level_dn, adc.max_code

    def white_level_dn(self) -> int:
        """Return the code at which a photosite saturates [DN]: that of the full well or of the ADC, whichever is lower."""
        return white_level_dn(self.moment_steps(), self.black_level_dn)

    def full_scale_dn(self) -> float:
        """Return the white level minus the black level [DN]."""
        return self.white_level_dn() - self.black_level_dn

    def gain_dn_per_e(self) -> float:
        """Return the gain of all stages together [DN/e-]: slope of the mean code over the photoelectrons, in the dark.

        It is that of a sensor that does not clip, even where dark current alone fills the wells.
        """
        dark, one = self._unclipped(0.0), self._unclipped(1.0)
        return one.mean - dark.mean

    def frame_gain_dn_per_e(self) -> float:
        """Return K of the frame [DN/e-]: codes for each of a pixel's photoelectrons, those of all binned photosites."""
        return self.gain_dn_per_e() / self.readout.summed

    def dark_signal_dn(self) -> float:
        """Return the mean code without light above the black level [DN], that of dark current: EMVA 1288's mu_y.dark."""
        return self._above_black(self.moments(0.0))

    def dark_noise_dn(self) -> float:
        """Return the standard deviation of the code without light and clipping [DN]: of read noise and dark current."""
        return math.sqrt(self._unclipped(0.0).variance)

    def electrons_at_white(self) -> float:
        """Return the photoelectrons that raise the mean code from that in the dark to the white level, linearly [e-].

        The mean code in the dark includes the dark current, which uses a part of the range; 0 where it uses all of it.
        """
        return max(self.white_level_dn() - self.moments(0.0).mean, 0.0) / self.gain_dn_per_e()

    def steps_at(self, mean_electrons: float) -> tuple[list[SignalStep], float]:
        """Return the steps that a photosite with these mean photoelectrons goes through, and the mean that they begin with."""
        return self.moment_steps(), mean_electrons

    def _unclipped(self, mean_electrons: float) -> Moments:
        """Return mean and variance of the code [DN] without clipping."""
        return reduce(lambda signal, step: step.unclipped(signal), self.moment_steps(), Moments(mean_electrons, 0.0))

    def _above_black(self, code: Moments) -> float:
        """Return the mean of a code above the black levels of the four places of a 2x2 block [DN]."""
        return code.mean - self.black_level_dn - sum(self.black_offsets_dn()) / 4.0

    def noise_floor(self) -> NoiseFloor | None:
        """Return the least noise of this exposure at the camera's ISOs (`Camera.isos`) and at the plan's own.

        It does not depend on the ISO within the measured range, since read noise in electrons has its least value at a line of
        the table. Rounding towards less noise makes it the same for cameras whose gain or bit depth differs a little.
        None where dark current saturates the sensor at every ISO, so that a frame shows nothing.
        """
        plans = (self, *(self.at(iso, self.exposure.time_s) for iso in self.camera.isos))
        most_e, least_e2 = 0.0, math.inf
        for plan in plans:
            dark, gain = plan.moments(0.0), plan.gain_dn_per_e()
            if dark.mean < plan.white_level_dn():
                most_e = max(most_e, (plan.white_level_dn() - dark.mean) / gain)
                least_e2 = min(least_e2, dark.variance / gain**2)
        if most_e == 0.0:
            return None
        floor_e = math.sqrt(2.0 ** math.floor(math.log2(least_e2))) if least_e2 > 0.0 else 0.0
        saturation_e = 2.0 ** math.ceil(math.log2(most_e)) if most_e > 1.0 else 1.0
        return NoiseFloor(saturation_e, floor_e, self.stage("photon_shot_noise") is not None)

    def black_offsets_dn(self) -> tuple[float, float, float, float]:
        """Return the black offsets [DN] in the upper left 2x2 block of the output frame, row by row."""
        block, output = np.zeros((2, 2)), self.readout.output
        for place, stage in enumerate(self.stages):
            if stage.black_offsets_dn is not None:
                block += _code_offsets_dn(stage.black_offsets_dn, self.stages[place + 1 :])
        (a, b), (c, d) = np.roll(block, (-output.y % 2, -output.x % 2), axis=(0, 1)).tolist()
        return a, b, c, d

    def noise_profile(self) -> tuple[float, float]:
        """Return S and O of DNG's NoiseProfile: variance = S x + O, x from 0 at black to 1 at white (DNG 1.4).

        x counts from the black level, so that the electrons of dark current are part of it.
        """
        dark, one = self._unclipped(0.0), self._unclipped(1.0)
        slope_dn = (one.variance - dark.variance) / (one.mean - dark.mean)
        at_black = max(dark.variance - slope_dn * self._above_black(dark), 0.0)
        return slope_dn / self.full_scale_dn(), at_black / self.full_scale_dn() ** 2


def read_out_of(steps: list[SignalStep]) -> list[SignalStep]:
    """Return those of the steps from the photoelectrons on, as `SensorPlan.moment_steps` has them, that read the charge out."""
    return steps[next(place for place, step in enumerate(steps) if step.name in READOUT_STAGES) :]


def _code_offsets_dn(offsets_dn: Iterable[float], later: tuple[Stage, ...]) -> np.ndarray:
    """Return the offsets of the code (2, 2) [DN] that offsets of the signal cause after passing through the later stages."""

    def code_dn(signal_dn: float) -> float:
        return reduce(lambda signal, stage: stage.moments(signal), later, Moments(signal_dn, 0.0)).mean

    return np.reshape([code_dn(offset) - code_dn(0.0) for offset in offsets_dn], (2, 2))


def plan_sensor(camera: Camera, light: Iterable[Stage], iso: float, exposure_time_s: float) -> SensorPlan:
    """Plan the sensor for one exposure.

    light: stages between scene radiance and photoelectrons (irradiance, exposure).
    Raises PhotositeError for an ISO that the camera does not have, and for a window that cuts through binned blocks.
    """
    stages = [*light, *camera.sensor_stages(iso, exposure_time_s).values()]
    return SensorPlan(camera, plan_readout(camera), in_order(stages))
