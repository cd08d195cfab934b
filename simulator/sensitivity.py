"""How sensitive a camera is at its ISO setting (ISO 12232:2019)."""

import math

from simulator.color import camera_response
from simulator.planner import Plan
from simulator.spectra import WAVELENGTHS_NM, efficiency_on, illuminant, luminance_cd_m2

MIDDLE_GREY = 0.18  # of white; 118 of 255 in sRGB, to which the exposure of an ISO speed belongs (standard output sensitivity)
EXPOSURE_LX_S = 10.0  # luminous exposure of middle grey at ISO 1: recommended exposure index = 10 lx s / H


def saturation_exposure_lx_s(planned: Plan) -> float:
    """Luminous exposure of a surface in daylight (D55) at which the first colour reaches the white level [lx s].

    Infinite for a camera that sees nothing of this light. 78 lx s over it is the saturation-based ISO speed.
    """
    camera, response = planned.camera, planned.camera.response
    light = illuminant("D55")
    efficiency = efficiency_on(WAVELENGTHS_NM, response.wavelengths_nm, response.quantum_efficiency)
    per_joule = camera_response(light[None], WAVELENGTHS_NM, efficiency).max()  # electrons per unit of light on a square metre
    electrons_per_lx_s = 1e-12 * camera.pixel_pitch_um**2 * camera.fill_factor * per_joule / luminance_cd_m2(light)
    dark_dn, one_dn = planned.moments(0.0).mean, planned.moments(1.0).mean
    span_dn = planned.white_level_dn() - planned.stage("adc").black_level_dn
    dn_per_lx_s = (one_dn - dark_dn) * electrons_per_lx_s
    return span_dn / dn_per_lx_s if dn_per_lx_s > 0 else math.inf


def baseline_exposure_ev(planned: Plan, iso: float) -> float | None:
    """Exposure that a converter must add so that middle grey, exposed as the ISO says, comes out as 18 % (DNG 1.4).

    BaselineExposure = log2(0.18 H_sat ISO / 10 lx s): 0.49 EV where the ISO is the saturation-based speed, which leaves half
    a stop above white. None for a camera that sees nothing of daylight.
    """
    gain = MIDDLE_GREY * saturation_exposure_lx_s(planned) * iso / EXPOSURE_LX_S
    return math.log2(gain) if 0 < gain < math.inf else None
