"""The plan of a sensor that combines several readings of a frame: what each reading is worth, and where one takes over."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeVar

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.sensor.camera.hdr_readout import LARGEST_DN, HdrReadout
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan
from simulator.sensor.stages.stage import Moments, SignalStep

KEY = "camera.hdr_readout"
T = TypeVar("T", float, np.ndarray)
_NEARBY_DN = 16  # codes around black over which the error of companding in the dark is averaged


@dataclass(frozen=True)
class Reading:
    """One reading of a frame.

    sensor: its plan alone, as if it were the whole read-out. exposure: which exposure it reads, from 0 on.
    charge: which charge it reads, from 0 on, one for each photodiode and exposure.
    factor: DN of the combined signal for each DN of its code above black.
    black_dn: black level of its codes [DN]. That of another photodiode has the dark current by which it differs, in proportion
    to light, from the first, so that both join without a step.
    switch_dn: below this code the reading is used; of the last reading above all codes.
    """

    sensor: SensorPlan
    exposure: int
    charge: int
    factor: float
    black_dn: float
    switch_dn: int


@dataclass(frozen=True)
class HdrSensorPlan(SensorPlan):
    """The plan of a sensor with an HDR read-out. Stages and numbers in the dark are those of the first reading.

    plans: plan of each reading alone. All levels are those of the combined signal [DN]: unit_dn of the first reading's DN are
    one, so that the range fits into 16 bits.
    """

    plans: tuple[SensorPlan, ...] = ()

    @property
    def spec(self) -> HdrReadout:
        """The camera's section."""
        assert self.camera.hdr_readout is not None  # plan_hdr
        return self.camera.hdr_readout

    @cached_property
    def readings(self) -> tuple[Reading, ...]:
        """The readings, that with the most gain and exposure first."""
        gains = [self._gain(place) for place in range(len(self.plans))]
        found = []
        for place, (plan, exposure) in enumerate(zip(self.plans, self.spec.exposure_of, strict=True)):
            range_dn, last = plan.white_level_dn() - plan.black_level_dn, place == len(self.plans) - 1
            switch_dn = LARGEST_DN + 1 if last else math.floor(plan.black_level_dn + self.spec.switch_at * range_dn)
            ratio = gains[0] / gains[place]
            own = ratio / self.unit_dn, self._black_dn(place)
            found.append(Reading(plan, exposure, self.spec.charge_of[place], *own, switch_dn))
        return tuple(found)

    @cached_property
    def unit_dn(self) -> int:
        """DN of the first reading that are one DN of the combined signal: the least power of two with which it fits 16 bits."""
        first, last = self.plans[0], self.plans[-1]
        ratio = self._gain(0) / self._gain(len(self.plans) - 1)
        top_dn, unit_dn = ratio * (last.white_level_dn() - self._black_dn(len(self.plans) - 1)), 1
        while math.ceil(first.black_level_dn / unit_dn) + top_dn / unit_dn > LARGEST_DN:
            unit_dn *= 2
        return unit_dn

    def _gain(self, place: int) -> float:
        """Return the gain of a reading for the electrons of the first one [DN/e-]."""
        return self.plans[place].gain_dn_per_e() * self.spec.exposures[place] * self.spec.light[place]

    def _black_dn(self, place: int) -> float:
        """Return the black level of a reading's codes [DN], as `Reading` has it."""
        plan, first = self.plans[place], self.plans[0]
        if self.spec.diode_of[place] == 0:
            return plan.black_level_dn
        return plan.black_level_dn + _dark_dn(plan) - _dark_dn(first) * self._gain(place) / self._gain(0)

    @property
    def exposures(self) -> tuple[SensorPlan, ...]:
        """Plan of the first reading of each exposure, for this plan's part of the frame."""
        places = [self.spec.exposure_of.index(exposure) for exposure in sorted(set(self.spec.exposure_of))]
        return tuple(replace(self.plans[place], readout=self.readout) for place in places)

    @property
    def black_level_dn(self) -> float:
        """Pedestal of the combined signal [DN], a whole number where its unit is not that of the first reading."""
        black_dn = self.plans[0].black_level_dn
        return black_dn if self.unit_dn == 1 else float(math.ceil(black_dn / self.unit_dn))

    def white_level_dn(self) -> int:
        """Return the combined signal of a photosite that is saturated in the last reading [DN]."""
        last = self.readings[-1]
        return round(self.combined_dn(last, float(last.sensor.white_level_dn())))

    def combined_dn(self, reading: Reading, code_dn: T) -> T:
        """Return the combined signal of a code [DN], neither rounded nor companded."""
        return (code_dn - reading.black_dn) * reading.factor + self.black_level_dn

    @cached_property
    def decoding(self) -> np.ndarray | None:
        """Signal of each stored code, (codes,) uint16 [DN] (DNG LinearizationTable); None without companding."""
        companding = self.spec.companding
        return None if companding is None else companding.decoding(self.white_level_dn())

    @property
    def stored_bits(self) -> int:
        """Bits of the stored codes."""
        companding = self.spec.companding
        return max(self.white_level_dn().bit_length(), 8) if companding is None else companding.bits

    def table(self, reading: Reading) -> np.ndarray:
        """Return the combined signal of each code of a reading after companding and decoding, (codes,) uint16 [DN]."""
        white_dn, companding = self.white_level_dn(), self.spec.companding
        codes = np.arange(reading.sensor.adc_range[1] + 1, dtype=np.float64)
        signal_dn = np.clip(self.combined_dn(reading, codes), 0.0, white_dn)
        if companding is None or self.decoding is None:
            return np.rint(signal_dn).astype(np.uint16)
        return self.decoding[companding.encode(signal_dn, white_dn)]

    def reading_steps(self, place: int) -> list[SignalStep]:
        """Return the steps from the photoelectrons of a reading's exposure to the combined signal, without companding."""
        reading, black_dn = self.readings[place], self.black_level_dn

        def combined(signal: Moments) -> Moments:
            return signal.plus(mean=-reading.black_dn).scaled(reading.factor).plus(mean=black_dn)

        return [*reading.sensor.moment_steps(), SignalStep("hdr_readout", combined)]

    def moment_steps(self) -> list[SignalStep]:
        """Return the steps of the first reading, with the error of companding in the dark."""
        first = self.readings[0]
        codes = np.arange(max(round(first.black_dn) - _NEARBY_DN, 0), round(first.black_dn) + _NEARBY_DN)
        error_dn2 = float(np.var(self.table(first)[codes] - self.combined_dn(first, codes)))
        companded = SignalStep("companding", lambda signal: signal.plus(variance=error_dn2))
        return [*self.reading_steps(0), *([companded] if error_dn2 > 0 else [])]

    def steps_at(self, mean_electrons: float) -> tuple[list[SignalStep], float]:
        """Return the steps of the reading that is used at these mean photoelectrons of the first exposure, and its own mean."""
        for place, reading in enumerate(self.readings):
            own_e = mean_electrons * self.spec.exposures[place] * self.spec.light[place]
            if reading.sensor.moments(own_e).mean < reading.switch_dn:
                return (self.moment_steps() if place == 0 else self.reading_steps(place)), own_e
        raise AssertionError("the last reading is used at all codes")

    def at(self, iso: float, exposure_time_s: float) -> Self:
        """Return the plan at another ISO and exposure time, as `SensorPlan.at`."""
        first = self.plans[0].at(iso, exposure_time_s)
        return replace(self, stages=first.stages, plans=_plans(first, self.spec, iso))

    def noise_floor(self) -> NoiseFloor | None:
        """Return the noise in the dark of the first reading, and the electrons that saturate the last, as `SensorPlan` does."""
        floor, full_e = self.plans[0].noise_floor(), self.electrons_at_white()
        if floor is None or full_e <= 0.0:
            return None
        return replace(floor, most_electrons=max(floor.most_electrons, 2.0 ** math.ceil(math.log2(max(full_e, 1.0)))))

    def black_offsets_dn(self) -> tuple[float, float, float, float]:
        """Return those of the first reading, which the dark parts of a picture are read with."""
        a, b, c, d = (offset / self.unit_dn for offset in super().black_offsets_dn())
        return a, b, c, d

    def describe(self) -> str:
        """Return the readings with their switch points, for `explain`."""
        parts = []
        for place, reading in enumerate(self.readings):
            share, gain = self.spec.exposures[place], self.spec.gains[place]
            light = "" if set(self.spec.light) == {1.0} else f", light {self.spec.light[place]:.4g}"
            until = "" if place == len(self.readings) - 1 else f" below {reading.switch_dn} DN"
            parts.append(f"exposure {share:.4g}, gain {gain:.4g}{light}, times {reading.factor * self.unit_dn:.4g}{until}")
        unit = "" if self.unit_dn == 1 else f"; {self.unit_dn} DN are one"
        return "; ".join(parts) + unit

    def describe_companding(self) -> tuple[bool, str]:
        """Return whether the combined signal is companded, and how it is stored, for `explain`."""
        companding, white_dn = self.spec.companding, self.white_level_dn()
        levels = f"{self.stored_bits} bits, white at {white_dn} DN"
        if companding is None:
            return False, f"stored as it is: {levels}"
        return True, f"{levels} after decoding, {len(companding.knees)} knees"


def plan_readings(sensor: SensorPlan, iso: float) -> SensorPlan:
    """Return the plan of the sensor with its camera's HDR read-out; the same plan for a camera without one.

    Raises PhotositeError for an ISO at which a gain was not measured, and for readings whose range does not grow.
    """
    spec = sensor.camera.hdr_readout
    if spec is None:
        return sensor
    planned = HdrSensorPlan(sensor.camera, sensor.readout, sensor.stages, _plans(sensor, spec, iso))
    for before, after in zip(planned.readings, planned.readings[1:], strict=False):
        reached, alone = (planned.combined_dn(one, float(one.sensor.white_level_dn())) for one in (after, before))
        rule = "a reading ends no farther than the one before it, as where the full well ends both; drop it"
        require(reached > 1.01 * alone, f"{KEY}.gains", list(spec.gains), rule)
        rule = "a reading after another must be worth more for each code; give less gain or exposure"
        require(after.factor > before.factor, f"{KEY}.gains", list(spec.gains), rule)
    if planned.decoding is not None:  # raises for knees beyond the range
        planned.table(planned.readings[0])
    return planned


def _dark_dn(plan: SensorPlan) -> float:
    """Return the mean code in the dark above the pedestal [DN], which optical black would tell a sensor."""
    return plan.moments(0.0).mean - plan.black_level_dn


def _plans(first: SensorPlan, spec: HdrReadout, iso: float) -> tuple[SensorPlan, ...]:
    """Return the plan of each reading alone. first: that of the first one, planned for this ISO."""
    time_s, plans = first.exposure.time_s, [first]
    for share, gain, diode in zip(spec.exposures[1:], spec.gains[1:], spec.photodiodes[1:], strict=True):
        try:
            plan = first.at(iso * gain, time_s * share)
            plans.append(plan.with_stages(stage.of_photodiode(diode) for stage in plan.stages))
        except PhotositeError as error:
            rule = f"{error.rule}; a reading of {KEY} has the gain {gain:g} at ISO {iso:g}, so raise one of them"
            raise error.replace(rule=rule) from None
    return tuple(plans)
