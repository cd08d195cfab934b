"""The least signal of a wanted signal-to-noise ratio, from which dynamic ranges are counted."""

import math

from simulator.errors import PhotositeError

CIRCLES_PER_DIAGONAL = 1291.0  # of Photons to Photos: 22 um on the Nikon D300, 23.6 mm x 15.8 mm
PDR_SNR = 20.0  # Claff, "Engineering and Photographic Dynamic Range" (photonstophotos.net, Sensor Analysis Primer)


def least_signal_e(dark_sigma_e: float, snr: float = 1.0) -> float:
    """Return the electrons n at which a linear sensor has this SNR [e-]: n / sqrt(n + sigma^2) = SNR.

    n = (SNR^2 + SNR sqrt(SNR^2 + 4 sigma^2)) / 2. At SNR 1 it is sqrt(sigma^2 + 1/4) + 1/2, for which EMVA 1288 R4.0 Linear
    takes sigma + 1/2. dark_sigma_e: temporal noise in the dark, rounding included [e-].
    """
    return 0.5 * (snr**2 + snr * math.sqrt(snr**2 + 4.0 * dark_sigma_e**2))


def photographic_snr(pitch_um: float, circle_um: float) -> float:
    """Return the SNR of one photosite that gives 20 in the circle of confusion (Photons to Photos).

    The circle has the area of a square of sqrt(pi) / 2 of its diameter c, and SNR grows with the square root of the area:
    20 / (sqrt(pi) / 2 c / p). Nikon D300: p = 5.5 um, c = 22 um: 5.64, log2 = 2.496.
    Raises PhotositeError for a circle that is not above 0.
    """
    if not circle_um > 0:
        raise PhotositeError("give a diameter above 0, such as 22 um", key="circle_of_confusion", value=f"{circle_um:g} um")
    return PDR_SNR / (0.5 * math.sqrt(math.pi) * circle_um / pitch_um)
