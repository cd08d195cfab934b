"""Camera file of a calibration as plain data: each number with its method of measurement and its confidence interval."""

import math
from dataclasses import dataclass

from simulator.measurement.calibration.camera_measurement import Calibration
from simulator.measurement.calibration.iso_measurement import IsoMeasurement
from simulator.measurement.statistics.interval import Interval

METHOD = "measured, photosite calibrate"


@dataclass(frozen=True)
class Assumed:
    """Values that raw files do not contain, in the form that a camera file has.

    make, model: names. pixel_pitch: quantity with unit. response: section of the
    camera file. full_well: electrons with unit, or None. sources: where these numbers come from, by key.
    """

    make: str
    model: str
    pixel_pitch: str
    response: dict[str, object]
    full_well: str | None
    sources: dict[str, str]


def camera_document(found: Calibration, assumed: Assumed) -> dict[str, object]:
    """Return a camera file as plain data, keys in the order of the shipped ones; `config.dump_yaml` writes it."""
    frame = found.first_frame
    height, width = frame.size
    white_dn = max(found.white_levels_dn.values())
    bits = max(8, math.ceil(math.log2(white_dn + 1)))
    black_dn = found.isos[0].dark.black_level_dn
    document = {
        "source": _sources(found, assumed),
        "make": assumed.make,
        "model": assumed.model,
        "width": width,
        "height": height,
        "pixel_pitch": assumed.pixel_pitch,
        "cfa": frame.cfa,
        "bit_depth": bits,
        "black_level": f"{black_dn:.3f} DN",
        "white_level": f"{white_dn} DN",
        "response": assumed.response,
    }
    after = after_gain_dn(found)
    if after > 0:
        document["read_noise_after_gain"] = f"{after:.4g} DN"
    if found.switch_iso is not None:
        document["conversion_gain"] = {"iso": found.switch_iso}
    document["iso_table"] = {one.iso: _line(one, found) for one in found.isos}
    document["stages"] = _stages(found, assumed)
    return document


def after_gain_dn(found: Calibration) -> float:
    """Return the read noise behind the analog gain [DN], at low conversion gain, below the total of every ISO.

    0 where the read noise is not normal, since its distribution is known for the total only.
    """
    if found.has_shape or found.switch_iso is not None and len(found.sources) < 2:
        return 0.0
    return min(found.sources[0].after_dn.value, *(0.999 * one.dark.read_noise_dn.value for one in found.isos))


def _line(one: IsoMeasurement, found: Calibration) -> dict[str, object]:
    line: dict[str, object] = {
        "gain": f"{one.gain_dn_per_e.value:.6g} DN/e-",
        "read_noise": f"{one.dark.read_noise_dn.value:.5g} DN",
    }
    if found.has_shape:
        line["tukey_lambda"] = round(one.dark.shape.shape.value, 4) if one.dark.shape else 0.14
    if one.dark.row_noise_dn.low > 0:
        line["row_noise"] = f"{one.dark.row_noise_dn.value:.4g} DN"
    if _has_bias(found):
        line["color_bias"] = [f"{one.dark.color_bias_dn[name].value:.3f} DN" for name in ("R", "Gr", "Gb", "B")]
    if len(found.isos) > 1:
        line["black_level"] = f"{one.dark.black_level_dn:.3f} DN"
    if found.white_levels_dn[one.iso] != max(found.white_levels_dn.values()):
        line["white_level"] = f"{found.white_levels_dn[one.iso]} DN"
    return line


def _has_bias(found: Calibration) -> bool:
    """Whether the black level of some colour plane differs from the mean of all planes by more than 4 standard errors."""
    parts = [part for one in found.isos for part in one.dark.color_bias_dn.values()]
    return found.first_frame.cfa != "MONO" and any(abs(part.value) > 4.0 * part.standard_error for part in parts)


def _stages(found: Calibration, assumed: Assumed) -> dict[str, object]:
    stages: dict[str, object] = {"photon_shot_noise": {}}
    if found.prnu is not None and found.prnu.low > 0:
        stages["prnu"] = {"source": _text(found.prnu, "", _flat_text(found)), "sigma": _number(found.prnu.value)}
    if found.dsnu_e.low > 0:
        stages["dsnu"] = {"source": _text(found.dsnu_e, "e-", _dark_text(found)), "sigma": f"{found.dsnu_e.value:.4g} e-"}
    if found.dark_current_e_per_s is not None:
        rate = found.dark_current_e_per_s
        source = _text(rate, "e-/s", "at the temperature of the frames, which is taken for the stage's")
        stages["dark_current"] = {"source": source, "rate": f"{rate.value:.4g} e-/s"}
    if assumed.full_well is not None:
        stages["full_well"] = {"source": f"assumed, {assumed.sources['full_well']}", "capacity": assumed.full_well}
    if found.column_dn.low > 0:
        source = _text(found.column_dn, "DN", _dark_text(found))
        stages["column_offset"] = {"source": source, "sigma": f"{found.column_dn.value:.4g} DN"}
    return stages


def _number(value: float) -> float:
    return float(f"{value:.4g}")


def _text(interval: Interval, unit: str, rest: str) -> str:
    return f"{METHOD}, {rest}, 95 % interval {interval.low:.4g} to {interval.high:.4g} {unit}".rstrip()


def _flat_text(found: Calibration) -> str:
    return f"{sum(one.pairs_used for one in found.isos)} pairs of flat fields"


def _dark_text(found: Calibration) -> str:
    return f"{sum(len(one.frames.short_darks) for one in found.isos)} dark frames"


def _sources(found: Calibration, assumed: Assumed) -> dict[str, str]:
    frame = found.first_frame
    clipped = f"{METHOD}, the code at which flats clip" if found.white_is_measured else "the raw files' metadata; no flat clips"
    less = "" if found.dark_current_e_per_s is None else f", less the dark current of {frame.time_s:g} s"
    sources = {
        "width, height, cfa": "the raw files, visible area",
        "pixel_pitch": f"assumed, {assumed.sources['pixel_pitch']}",
        "response": f"assumed, {assumed.sources['response']}",
        "bit_depth": "derived, the smallest that holds the white level",
        "black_level": f"{METHOD}, mean of {len(found.isos[0].frames.short_darks)} dark frames at ISO {frame.iso}{less}",
        "white_level": clipped,
    }
    if after_gain_dn(found) > 0:
        part = found.sources[0]
        sources["read_noise_after_gain"] = (
            f"derived, two-source model sigma_DN^2 = (K sigma_pre)^2 + sigma_post^2 fitted to ISO {part.isos[0]} to "
            f"{part.isos[-1]}: sigma_pre = {part.before_e.value:.3g} e-, sigma_post = {part.after_dn.value:.3g} DN"
        )
    if found.switch_iso is not None:
        sources["conversion_gain"] = "derived, where the read noise in electrons drops"
    return sources | {f"iso_table.{one.iso}": _line_source(one) for one in found.isos}


def _line_source(one: IsoMeasurement) -> str:
    parts = [
        f"gain {one.gain_dn_per_e.low:.5g} to {one.gain_dn_per_e.high:.5g} DN/e-",
        f"read_noise {one.dark.read_noise_dn.low:.4g} to {one.dark.read_noise_dn.high:.4g} DN, row noise and rounding off",
    ]
    if one.dark.shape is not None:
        parts.append(f"tukey_lambda {one.dark.shape.shape.low:.3f} to {one.dark.shape.shape.high:.3f}")
    parts.append(f"row_noise {one.dark.row_noise_dn.low:.3g} to {one.dark.row_noise_dn.high:.3g} DN")
    parts += [f"color_bias {name} {part.low:.3f} to {part.high:.3f} DN" for name, part in one.dark.color_bias_dn.items()]
    counts = f"{len(one.frames.short_darks)} dark frames, {one.pairs_used} pairs of flat fields"
    return f"{METHOD}, {counts}, 95 % intervals: {'; '.join(parts)}"
