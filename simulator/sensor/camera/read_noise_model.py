"""Read noise with two sources, before and after the analog gain: the form for a camera without a measured table."""

import math
from dataclasses import dataclass

from simulator.errors import PhotositeError, require
from simulator.sensor.camera.camera_sections import ConversionGainSwitch, IsoSetting
from simulator.sensor.camera.iso_table import EXTRAPOLATE
from simulator.units import DigitalNumbers, DigitalNumbersPerElectron, Electrons


@dataclass(frozen=True)
class ReadNoiseModel:
    """sigma_e^2 = (sigma_before / ratio)^2 + (sigma_after / K)^2, with K proportional to the ISO.

    Real cameras need both sources: the noise in electrons decreases with the ISO until only the part before the gain is left.
    `ratio` is that of the camera's conversion_gain from its ISO up, and 1 below.

    gain_at_iso_100_dn_per_e: K of EMVA 1288 at ISO 100 [DN/e-], > 0.
    before_gain_e: read noise that arises before the analog gain, at low conversion gain [e-], >= 0.
    after_gain_dn: read noise that arises after it [DN], >= 0.
    lowest_iso: lowest ISO at which the model is valid.
    highest_iso: highest ISO at which the model is valid.
    """

    gain_at_iso_100_dn_per_e: DigitalNumbersPerElectron
    before_gain_e: Electrons
    after_gain_dn: DigitalNumbers
    lowest_iso: int
    highest_iso: int

    def __post_init__(self) -> None:
        key, gain = "camera.read_noise_model", self.gain_at_iso_100_dn_per_e
        require(0 < gain < math.inf, f"{key}.gain_at_iso_100", f"{gain:g} DN/e-", "give a gain above 0 DN/e-")
        for name, sigma, unit in (("before_gain", self.before_gain_e, "e-"), ("after_gain", self.after_gain_dn, "DN")):
            require(0 <= sigma < math.inf, f"{key}.{name}", f"{sigma:g} {unit}", "a standard deviation is not negative")
        require(self.lowest_iso > 0, f"{key}.lowest_iso", self.lowest_iso, "an ISO is above 0")
        rule = f"is not above lowest_iso = {self.lowest_iso}"
        require(self.highest_iso > self.lowest_iso, f"{key}.highest_iso", self.highest_iso, rule)

    def check_switch(self, switch: ConversionGainSwitch | None) -> None:
        """Raise PhotositeError for a conversion-gain switch without the ratio that the model needs."""
        rule = "a read_noise_model needs the ratio of the two conversion gains, such as `ratio: 4`"
        require(switch is None or switch.ratio is not None, "camera.conversion_gain.ratio", None, rule)

    def isos(self) -> tuple[int, ...]:
        """Return the full stops from ISO 100 within the range, and its two ends."""
        stops = {round(100 * 2.0**stop) for stop in range(-6, 16)}
        return tuple(sorted({self.lowest_iso, self.highest_iso} | {i for i in stops if self.lowest_iso < i < self.highest_iso}))

    def setting(self, iso: float, extrapolate: bool, ratio: float, camera: str) -> IsoSetting:
        """Return gain and total read noise at an ISO.

        ratio: conversion ratio at this ISO. camera: its name, for the message.
        Raises PhotositeError beyond lowest_iso and highest_iso unless `extrapolate`.
        """
        require(iso > 0, "exposure.iso", iso, "an ISO is above 0")
        if not (self.lowest_iso <= iso <= self.highest_iso or extrapolate):
            raise PhotositeError(
                f"the read noise of the {camera} is stated for {self.lowest_iso} to {self.highest_iso}; "
                f"give an ISO within, or {EXTRAPOLATE}",
                key="exposure.iso",
                value=iso,
            )
        gain = self.gain_at_iso_100_dn_per_e * iso / 100.0
        return IsoSetting(gain, math.hypot(gain * self.before_gain_e / ratio, self.after_gain_dn))
