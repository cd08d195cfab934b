"""Exposure values, light meters and exposure at the focal plane.

APEX: Ev = Av + Tv = Bv + Sv (Exif 2.3, CIPA DC-008-2012, Annex C). Meter constants K and C of ISO 2720 and 2721, and
H = q L t / N^2 of ISO 12232, as colour-hdri (BSD-3) and Wikipedia ("Exposure value", "Film speed") quote them.
"""

import math

K_REFLECTED = 12.5  # of a meter for reflected light [cd s m^-2]; makers use 10.6 to 13.4
C_INCIDENT = 250.0  # of a meter with a flat receptor for incident light [lx s]; 340 with a dome


def exposure_value(f_number: float, time_s: float) -> float:
    """Return EV = log2(N^2 / t): 0 for f/1 at 1 s, one more for half the exposure."""
    return aperture_value(f_number) + time_value(time_s)


def exposure_value_100(f_number: float, time_s: float, iso: float) -> float:
    """Return the EV at ISO 100 that means the same brightness: EV - log2(ISO / 100)."""
    return exposure_value(f_number, time_s) - math.log2(iso / 100.0)


def aperture_value(f_number: float) -> float:
    """Return Av = 2 log2 N."""
    return 2.0 * math.log2(f_number)


def time_value(time_s: float) -> float:
    """Return Tv = -log2 t, t in seconds."""
    return -math.log2(time_s)


def speed_value(iso: float) -> float:
    """Return Sv = log2(ISO / 3.125): 5 at ISO 100."""
    return math.log2(iso / 3.125)


def metered_luminance_cd_m2(f_number: float, time_s: float, iso: float, k: float = K_REFLECTED) -> float:
    """Return the mean luminance for which a meter of constant K gives these settings: L = K N^2 / (t ISO) [cd m^-2]."""
    return k * f_number**2 / (time_s * iso)


def metered_illuminance_lx(f_number: float, time_s: float, iso: float, c: float = C_INCIDENT) -> float:
    """Return the illuminance of the subject for which a meter of constant C gives these settings: E = C N^2 / (t ISO) [lx]."""
    return c * f_number**2 / (time_s * iso)


def exposure_value_of_luminance(luminance_cd_m2: float, iso: float = 100.0, k: float = K_REFLECTED) -> float:
    """Return the EV that a meter gives for a mean luminance: log2(L ISO / K)."""
    return math.log2(luminance_cd_m2 * iso / k)


def q_factor(transmittance: float = 0.9, vignetting: float = 0.98, angle_deg: float = 10.0) -> float:
    """Return q = (pi / 4) T v cos^4(theta) of ISO 12232: 0.6516 for its usual lens, focused far away."""
    return 0.25 * math.pi * transmittance * vignetting * math.cos(math.radians(angle_deg)) ** 4


def focal_plane_exposure_lx_s(
    luminance_cd_m2: float,
    f_number: float,
    time_s: float,
    q: float | None = None,
    extension: float = 1.0,
    flare_lx_s: float = 0.0,
) -> float:
    """Return the exposure at the focal plane H = q L t / (N i/f)^2 + flare [lx s] (ISO 12232).

    q: of `q_factor`, its default when left out. extension: image distance over focal length, 1 for a subject far away.
    """
    factor = q_factor() if q is None else q
    return factor * luminance_cd_m2 * time_s / (f_number * extension) ** 2 + flare_lx_s
