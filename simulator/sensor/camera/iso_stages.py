"""The sensor stages whose parameters follow from the ISO setting."""

import math

from simulator.sensor.camera.camera_sections import IsoSetting
from simulator.sensor.camera.cfa import Cfa, CfaName, Pattern
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.color_bias import ColorBias
from simulator.sensor.stages.conversion_gain import ConversionGain
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.sensor.stages.row_noise import RowNoise
from simulator.sensor.stages.stage import Stage


def iso_stages(
    setting: IsoSetting, after_gain_dn: float, spread: float, ratio: float, cfa: CfaName, bit_depth: int
) -> dict[str, Stage]:
    """Return the stages that an ISO setting determines, by stem, without those that have no effect.

    High conversion gain multiplies the signal by `ratio` before the read noise, so that an analog gain of K / ratio results in
    the total gain K.
    setting: with black and white level filled in. after_gain_dn: part of a normal read noise that arises after the gain [DN].
    spread: standard deviation of ln sigma of the read noise before the gain. ratio: conversion gain over the low one.
    """
    stages: dict[str, Stage] = _read_noise(setting, after_gain_dn, spread, ratio)
    if ratio != 1.0:
        stages["conversion_gain"] = ConversionGain(ratio)
    if setting.row_noise_dn > 0:
        stages["row_noise"] = RowNoise(setting.row_noise_dn)
    if setting.color_bias_dn is not None and any(setting.color_bias_dn):
        stages["color_bias"] = ColorBias(_by_place(setting.color_bias_dn, Cfa.named(cfa).planes))
    stages["analog_gain"] = AnalogGain(setting.gain_dn_per_e / ratio)
    stages["adc"] = Adc(bit_depth, *setting.levels_dn)
    return stages


def _read_noise(setting: IsoSetting, after_gain_dn: float, spread: float, ratio: float) -> dict[str, Stage]:
    """Return the stages of the read noise before and after the gain, by stem, without those of sigma 0.

    With a tukey_lambda all read noise is added after the gain, because it was measured as the total. A normal one is split:
    sigma_e^2 = (sigma_DN / K)^2 - (sigma_post / K)^2 is added before the gain, multiplied by the ratio, since the stage before
    the gain works in electrons at low conversion gain.
    """
    total_dn = setting.read_noise_dn
    if setting.tukey_lambda is not None:
        return {"read_noise_after_gain": ReadNoiseAfterGain(total_dn, setting.tukey_lambda)}
    before_e = ratio * math.sqrt(max(total_dn**2 - after_gain_dn**2, 0.0)) / setting.gain_dn_per_e
    before = ReadNoiseBeforeGain(before_e, spread)
    stages: dict[str, Stage] = {before.stem: before} if before.has_effect else {}
    return stages | ({"read_noise_after_gain": ReadNoiseAfterGain(after_gain_dn)} if after_gain_dn > 0 else {})


def _by_place(by_color: tuple[float, ...], planes: Pattern) -> tuple[float, ...]:
    """Return values of red, green beside red, green beside blue, blue in the order of the sensor's 2x2 block, row by row."""
    red, green_red, green_blue, blue = by_color
    with_red, with_blue = {0: red, 1: green_red}, {2: blue, 1: green_blue}  # by colour plane
    return tuple((with_red if 0 in row else with_blue)[plane] for row in planes for plane in row)
