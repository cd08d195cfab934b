"""Wavefront of a lens over field and wavelength, as tracing its rays gives it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.errors import require
from simulator.units import Micrometres, Nanometres

MOST_ORDER = 12


@lru_cache(maxsize=8)
def power_pairs(order: int) -> tuple[tuple[int, int], ...]:
    """Return (p, q) of the terms (r^2)^p along^q, 1 <= 2 p + q <= order, by order and then by q."""
    return tuple(((total - q) // 2, q) for total in range(1, order + 1) for q in range(total % 2, total + 1, 2))


@dataclass(frozen=True)
class WavefrontTable:
    """W = sum over (p, q) of c (r^2)^p (r cos)^q, with r = 1 at the rim, the angle from the direction of the field.

    Of a lens that is symmetric about its axis (Hopkins 1950): no other terms exist. Coefficients are linear in the field and in
    the wavelength between entries, constant beyond.
    order: highest power of r, 1 to 12.
    fields: distance of the image point from the centre, shares of the sensor's half diagonal, ascending from 0.
    wavelengths_nm: ascending [nm].
    coefficients_um: by wavelength, field and term, terms as `power_pairs` has them [um].
    Raises PhotositeError for axes that do not ascend, and tables of another shape.
    """

    order: int
    fields: tuple[float, ...]
    wavelengths_nm: tuple[Nanometres, ...]
    coefficients_um: tuple[tuple[tuple[Micrometres, ...], ...], ...]

    def __post_init__(self) -> None:
        key = "lens.aberrations.traced"
        require(1 <= self.order <= MOST_ORDER, f"{key}.order", self.order, f"give 1 to {MOST_ORDER}")
        for name, axis in (("fields", self.fields), ("wavelengths", self.wavelengths_nm)):
            ascends = len(axis) > 0 and all(low < high for low, high in zip(axis[:-1], axis[1:], strict=True))
            require(ascends, f"{key}.{name}", list(axis), "give ascending numbers, each once")
        require(self.fields[0] == 0, f"{key}.fields", self.fields[0], "the first field is the axis, 0")
        terms = len(power_pairs(self.order))
        sizes = {len(row) for plane in self.coefficients_um for row in plane}
        counts = {len(plane) for plane in self.coefficients_um}
        good = len(self.coefficients_um) == len(self.wavelengths_nm) and counts == {len(self.fields)} and sizes == {terms}
        wanted = f"give {len(self.wavelengths_nm)} wavelengths of {len(self.fields)} fields of {terms} coefficients"
        require(good, f"{key}.coefficients", f"{len(self.coefficients_um)} x {sorted(counts)} x {sorted(sizes)}", wanted)

    def wavefront_error_um(self, along: np.ndarray, r2: np.ndarray, field: float, wavelength_nm: float) -> np.ndarray:
        """Return W [um] at pupil points: their component along the field and their squared radius; same shape as both."""
        by_q: dict[int, dict[int, float]] = {}
        for (p, q), value in zip(power_pairs(self.order), self.terms_um(field, wavelength_nm), strict=True):
            by_q.setdefault(q, {})[p] = float(value)
        path = np.zeros(np.broadcast(along, r2).shape)
        for q in range(max(by_q), -1, -1):  # Horner's rule in both
            inner = np.zeros_like(path)
            for p in range(max(by_q[q]), -1, -1):
                inner = inner * r2 + by_q[q].get(p, 0.0)
            path = path * along + inner
        return path

    def terms_um(self, field: float, wavelength_nm: float) -> np.ndarray:
        """Return the coefficients at a field and a wavelength, (terms,) float64 [um]."""
        table = _as_array(self.coefficients_um)
        place = float(np.interp(wavelength_nm, self.wavelengths_nm, np.arange(len(self.wavelengths_nm))))
        low = min(int(place), len(table) - 1)
        plane = table[low] if place == low else (1 - place + low) * table[low] + (place - low) * table[low + 1]
        place = float(np.interp(field, self.fields, np.arange(len(self.fields))))
        low = min(int(place), len(plane) - 1)
        return plane[low] if place == low else (1 - place + low) * plane[low] + (place - low) * plane[low + 1]


@lru_cache(maxsize=8)
def _as_array(coefficients: tuple[tuple[tuple[float, ...], ...], ...]) -> np.ndarray:
    return np.array(coefficients)
