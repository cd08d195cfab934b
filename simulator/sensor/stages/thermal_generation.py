"""How fast electrons are generated in the dark at a temperature, to which dark current is proportional."""

import math

from simulator.errors import require

BOLTZMANN_EV_PER_K = 8.617333262e-5  # CODATA 2018


def thermal_generation(temperature_k: float) -> float:
    """Return T^1.5 exp(-Eg(T) / 2 k T), to which dark current is proportional (Janesick 2001, eq. 7.23).

    Eg: band gap of silicon, 1.1557 eV - 7.021e-4 T^2 / (1108 K + T) eV (Varshni 1967).
    """
    gap_ev = 1.1557 - 7.021e-4 * temperature_k**2 / (1108.0 + temperature_k)
    return temperature_k**1.5 * math.exp(-gap_ev / (2.0 * BOLTZMANN_EV_PER_K * temperature_k))


def rate_ratio(temperature_k: float, measured_at_k: float) -> float:
    """Return the dark current at a temperature over that at the temperature at which it was measured."""
    return thermal_generation(temperature_k) / thermal_generation(measured_at_k)


def check_temperatures(stem: str, temperature_k: float, measured_at_k: float) -> None:
    """Raise PhotositeError for temperatures of a stage at which no sensor works."""
    for key, kelvins in (("temperature", temperature_k), ("measured_at", measured_at_k)):
        require(150 <= kelvins <= 400, f"{stem}.{key}", f"{kelvins:g} K", "give 150 to 400 K, such as 298.15 K")
