"""Exposure of a shot in a photographer's numbers: what the camera chose, stops and marks, EV, and ISO 12232 speeds."""

import math

from simulator.command_line.shot_numbers import Fact
from simulator.exposure.exposure_value import (
    C_INCIDENT,
    K_REFLECTED,
    exposure_value,
    exposure_value_100,
    focal_plane_exposure_lx_s,
    metered_illuminance_lx,
    metered_luminance_cd_m2,
    q_factor,
)
from simulator.exposure.stops import equal_exposures, mark_of_f_number, mark_of_time, write_time
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.metered_shot import Metered
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.sensor.iso_speed import (
    MIDDLE_GREY,
    saturation_based_speed,
    saturation_exposure_lx_s,
    standard_output_sensitivity,
)


def exposure_facts(shot: Shot, planned: Plan) -> list[Fact]:
    """Return the numbers of an exposure. shot: as it is planned (`Plan.settle`)."""
    has_aperture = math.isfinite(shot.lens.f_number)
    metered = [] if planned.metered is None else _metered_facts(planned.metered)
    return [*metered, *_dial_facts(shot), *(_value_facts(shot) if has_aperture else []), *_speed_facts(shot, planned)]


def _metered_facts(found: Metered) -> list[Fact]:
    """What the camera chose, and what kept it from the wanted exposure."""
    metering, stops = found.metering, found.deviation_stops
    how = f"{metering.pattern}, {100 * metering.level:.3g} % of white, {found.compensation:+g} stops"
    decided = ", ".join(found.limits) or "no limit of the dials"
    off = f"{stops:+.2f} stops" if math.isfinite(stops) else "too dark"
    facts = [Fact("mode", found.mode, how), Fact("above the meter", off, f"bound by: {decided}")]
    return facts if found.bound is None else [*facts, Fact("bound of the metering", "reached", found.bound)]


def _dial_facts(shot: Shot) -> list[Fact]:
    """Settings beside the true stops of their marks."""
    lens, time_s = shot.lens, shot.exposure.time_s
    facts, mark = [], mark_of_f_number(lens.f_number) if math.isfinite(lens.f_number) else None
    if mark is not None:
        off = 2.0 * math.log2(mark[1] / lens.f_number)
        facts.append(Fact("f-number", f"f/{lens.f_number:.4g}", f"{off:+.3f} stops from f/{mark[1]:.4g}, marked f/{mark[0]:g}"))
    if (mark := mark_of_time(time_s)) is not None:
        off, true, marked = math.log2(time_s / mark[1]), write_time(mark[1]), write_time(mark[0])
        facts.append(Fact("time", write_time(time_s), f"{off:+.3f} stops from {true}, marked {marked}"))
    else:
        facts.append(Fact("time", write_time(time_s), "no mark of a dial"))
    if isinstance(lens, ThinLens):
        ideal = lens.irradiance_per_radiance_sr() / _aplanatic_sr(lens)
        facts.append(Fact("light against 1/N^2", f"{math.log2(ideal):+.3f} stops", f"lens.irradiance: {lens.irradiance}"))
    return facts


def _aplanatic_sr(lens: ThinLens) -> float:
    """Return the solid angle that is exactly in proportion to 1/N^2 [sr]."""
    share = 1.0 if lens.nd_filter is None else lens.nd_filter.transmittance
    return math.pi * lens.effective_transmittance * share / (4.0 * lens.working_f_number**2)


def _value_facts(shot: Shot) -> list[Fact]:
    """Exposure values, and the light that a meter gives these settings for."""
    settings = shot.lens.f_number, shot.exposure.time_s, shot.exposure.iso
    ev, ev_100 = exposure_value(*settings[:2]), exposure_value_100(*settings)
    luminance, illuminance = metered_luminance_cd_m2(*settings), metered_illuminance_lx(*settings)
    exposure = focal_plane_exposure_lx_s(luminance, *settings[:2])
    facts = [
        Fact("EV", f"{ev:.2f}", "log2(N^2 / t)"),
        Fact("EV at ISO 100", f"{ev_100:.2f}", f"EV - log2(ISO / 100), ISO {shot.exposure.iso}"),
        Fact("metered luminance", f"{luminance:.4g} cd/m^2", f"K N^2 / (t ISO), K = {K_REFLECTED:g}"),
        Fact("metered illuminance", f"{illuminance:.4g} lx", f"C N^2 / (t ISO), C = {C_INCIDENT:g}"),
        Fact("its exposure", f"{exposure:.4g} lx s", f"q L t / N^2, q = {q_factor():.4f} (ISO 12232)"),
    ]
    pairs = equal_exposures(*settings[:2])
    if len(pairs) > 1:
        off = [stops for *_, stops in pairs]
        (first_f, first_s, _), (last_f, last_s, _) = pairs[0], pairs[-1]
        ends = f"f/{first_f:g} at {write_time(first_s)} to f/{last_f:g} at {write_time(last_s)}"
        facts.append(Fact("same EV, by marks", f"{min(off):+.2f} to {max(off):+.2f} stops", f"{ends}; true: 0"))
    return facts


def _speed_facts(shot: Shot, planned: Plan) -> list[Fact]:
    """Speeds of the camera at this ISO setting (ISO 12232)."""
    saturation = saturation_exposure_lx_s(planned.sensor)
    if not math.isfinite(saturation):
        return []
    speed, output = saturation_based_speed(saturation), standard_output_sensitivity(MIDDLE_GREY * saturation)
    return [
        Fact("saturating exposure", f"{saturation:.4g} lx s", f"H_sat, daylight D55, at ISO {shot.exposure.iso}"),
        Fact("saturation-based speed", f"ISO {speed:.4g}", "78 lx s / H_sat (ISO 12232)"),
        Fact("output sensitivity (SOS)", f"ISO {output:.4g}", "10 lx s / (0.18 H_sat), raw white is white"),
    ]
